//! Whether the pixels of an X11 output are those of the desktop: its mode, its rotation and its transform.

use x11rb::connection::Connection;
use x11rb::protocol::randr::{ConnectionExt, GetCrtcTransformReply, Rotation};

/// One, in the fixed-point numbers of X11.
const ONE: i32 = 1 << 16;

/// Why this CRTC does not show the pixels of the desktop one to one; none when it does, or when X11 does not say.
pub fn of_crtc(crtc: u32) -> Option<String> {
    let (connection, screen) = x11rb::connect(None).ok()?;
    let root = connection.setup().roots.get(screen)?.root;
    let resources = connection.randr_get_screen_resources_current(root).ok()?.reply().ok()?;
    let info = connection.randr_get_crtc_info(crtc, resources.config_timestamp).ok()?.reply().ok()?;
    let mode = resources.modes.iter().find(|mode| mode.id == info.mode)?;
    if info.rotation != Rotation::ROTATE0 {
        return Some("rotated or mirrored: set its rotation to normal".to_owned());
    }
    if (mode.width, mode.height) != (info.width, info.height) {
        return Some(format!("scaled from a mode of {} x {}: set its scale to 1", mode.width, mode.height));
    }
    let transform = connection.randr_get_crtc_transform(crtc).ok()?.reply().ok()?;
    if is_identity(&transform) { None } else { Some("transformed: set its transform to none".to_owned()) }
}

fn is_identity(reply: &GetCrtcTransformReply) -> bool {
    let t = &reply.current_transform;
    let rows = [[t.matrix11, t.matrix12, t.matrix13], [t.matrix21, t.matrix22, t.matrix23]];
    let last = [t.matrix31, t.matrix32, t.matrix33];
    rows == [[ONE, 0, 0], [0, ONE, 0]] && last == [0, 0, ONE]
}
