//! Checks that an X11 output shows the pixels of the desktop one to one: mode, rotation and transform.

use x11rb::connection::Connection;
use x11rb::protocol::randr::{ConnectionExt, GetCrtcTransformReply, Rotation};

/// The number 1 in the fixed-point format of X11.
const ONE: i32 = 1 << 16;

/// State of a CRTC in the X server.
struct Crtc {
    upright: bool,
    size_px: (u16, u16),
    mode_px: (u16, u16),
    /// 3 x 3 matrix, row by row.
    transform: [i32; 9],
}

/// Why this CRTC does not show the pixels of the desktop one to one; `None` if it does, or if X11 does not report it.
pub fn of_crtc(crtc: u32) -> Option<String> {
    let (connection, screen) = x11rb::connect(None).ok()?;
    let root = connection.setup().roots.get(screen)?.root;
    let resources = connection.randr_get_screen_resources_current(root).ok()?.reply().ok()?;
    let info = connection.randr_get_crtc_info(crtc, resources.config_timestamp).ok()?.reply().ok()?;
    let mode = resources.modes.iter().find(|mode| mode.id == info.mode)?;
    let transform = connection.randr_get_crtc_transform(crtc).ok()?.reply().ok()?;
    scaling(&Crtc {
        upright: info.rotation == Rotation::ROTATE0,
        size_px: (info.width, info.height),
        mode_px: (mode.width, mode.height),
        transform: rows(&transform),
    })
}

fn rows(reply: &GetCrtcTransformReply) -> [i32; 9] {
    let t = &reply.current_transform;
    [
        t.matrix11, t.matrix12, t.matrix13, t.matrix21, t.matrix22, t.matrix23, t.matrix31, t.matrix32,
        t.matrix33,
    ]
}

fn scaling(crtc: &Crtc) -> Option<String> {
    if !crtc.upright {
        return Some("rotated or mirrored: set its rotation to normal".to_owned());
    }
    if crtc.mode_px != crtc.size_px {
        let (width, height) = crtc.mode_px;
        return Some(format!("scaled from a mode of {width} x {height}: set its scale to 1"));
    }
    let identity = crtc.transform == [ONE, 0, 0, 0, ONE, 0, 0, 0, ONE];
    if identity { None } else { Some("transformed: set its transform to none".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pixels_one_to_one_pass() {
        let crtc = |upright, mode_px, scale| Crtc {
            upright,
            size_px: (912, 1140),
            mode_px,
            transform: [scale, 0, 0, 0, ONE, 0, 0, 0, ONE],
        };
        assert_eq!(scaling(&crtc(true, (912, 1140), ONE)), None);
        let reason = |crtc| scaling(&crtc).expect("unfit");
        assert!(reason(crtc(false, (912, 1140), ONE)).contains("rotated"));
        assert!(reason(crtc(true, (1920, 1080), ONE)).contains("a mode of 1920 x 1080"));
        assert!(reason(crtc(true, (912, 1140), ONE / 2)).contains("transformed"));
    }
}
