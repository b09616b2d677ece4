//! Numbers of umockdev's messages, of the ioctls of usbfs, and of Linux errors.

pub const IOCTL: u64 = 1;
pub const DONE: u64 = 3;
pub const READ_MEMORY: u64 = 5;
pub const WRITE_MEMORY: u64 = 6;

// Directions of an ioctl, as Linux numbers them.
pub const NONE: u32 = 0;
pub const WRITE: u32 = 1;
pub const READ: u32 = 2;

/// The number of a usbfs ioctl, composed as in Linux.
pub const fn ioctl(direction: u32, number: u32, size: u32) -> u32 {
    direction << 30 | size << 16 | 0x55 << 8 | number
}

pub const SET_INTERFACE: u32 = ioctl(READ, 4, 8);
pub const SET_CONFIGURATION: u32 = ioctl(READ, 5, 4);
pub const GET_DRIVER: u32 = ioctl(WRITE, 8, 260);
pub const SUBMIT_URB: u32 = ioctl(READ, 10, 56);
pub const DISCARD_URB: u32 = ioctl(NONE, 11, 0);
pub const REAP_URB: u32 = ioctl(WRITE, 12, 8);
pub const REAP_URB_NOW: u32 = ioctl(WRITE, 13, 8);
pub const CLAIM: u32 = ioctl(READ, 15, 4);
pub const RELEASE: u32 = ioctl(READ, 16, 4);
pub const DRIVER: u32 = ioctl(WRITE | READ, 18, 16);
pub const RESET: u32 = ioctl(NONE, 20, 0);
pub const CLEAR_HALT: u32 = ioctl(READ, 21, 4);
pub const DISCONNECT: u32 = ioctl(NONE, 22, 0);
pub const CONNECT: u32 = ioctl(NONE, 23, 0);
pub const CAPABILITIES: u32 = ioctl(READ, 26, 4);
pub const DISCONNECT_CLAIM: u32 = ioctl(READ, 27, 264);

pub const ENOENT: i32 = 2;
pub const EAGAIN: i32 = 11;
pub const EBUSY: i32 = 16;
pub const ENODEV: i32 = 19;
pub const EINVAL: i32 = 22;
pub const ENOTTY: i32 = 25;
pub const EPIPE: i32 = 32;
pub const ENODATA: i32 = 61;
pub const ESHUTDOWN: i32 = 108;
