//! The window under Xvfb: the screen has exactly the pixels that were shown.
//!
//! `under_xvfb` starts servers of several sizes and runs the other tests, which are ignored outside of it.
#![cfg(all(feature = "window", target_os = "linux"))]

use lightcrafter::Error;
use lightcrafter::window::{IMAGE_BYTES, PatternWindow, outputs};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConnectionExt, ImageFormat};

/// The file in which Xvfb keeps its screen, in the format of xwd.
const SCREEN: &str = "LIGHTCRAFTER_SCREEN";

struct Server {
    child: Child,
    display: String,
    folder: PathBuf,
}

/// Two outputs of 912 x 1140, side by side, from the dummy driver of Xorg.
const TWO_OUTPUTS: &str = r#"
Section "ServerFlags"
  Option "AutoAddDevices" "false"
EndSection
Section "Device"
  Identifier "dummy"
  Driver "dummy"
  VideoRam 65536
EndSection
Section "Monitor"
  Identifier "monitor"
  HorizSync 5-1000
  VertRefresh 5-200
  Modeline "912x1140" 73.0 912 968 1032 1040 1140 1157 1167 1170
EndSection
Section "Screen"
  Identifier "screen"
  Device "dummy"
  Monitor "monitor"
  DefaultDepth 24
  SubSection "Display"
    Depth 24
    Modes "912x1140"
    Virtual 4096 2400
  EndSubSection
EndSection
"#;

impl Server {
    /// A screen of this size in memory.
    fn xvfb(size: &str) -> Self {
        Self::start(size, |folder| format!("Xvfb -screen 0 {size}x24 -fbdir {folder}"))
    }

    /// Outputs DUMMY0 and DUMMY1. This starts the server without the wrapper that Debian has for consoles, because with the
    /// dummy driver the server needs neither a console nor root.
    fn two_outputs() -> Self {
        let server = Self::start("two", |folder| {
            fs::write(format!("{folder}/xorg.conf"), TWO_OUTPUTS).unwrap();
            let xorg = Path::new("/usr/lib/xorg/Xorg");
            let xorg = if xorg.exists() { xorg } else { Path::new("Xorg") };
            format!("{} -config {folder}/xorg.conf -logfile {folder}/log -noreset", xorg.display())
        });
        for order in ["--addmode DUMMY1 912x1140", "--output DUMMY1 --mode 912x1140 --right-of DUMMY0"] {
            let mut xrandr = Command::new("xrandr");
            let status = xrandr.env("DISPLAY", &server.display).args(order.split(' ')).status();
            assert!(status.expect("apt-get install x11-xserver-utils").success(), "xrandr {order}");
        }
        server
    }

    /// Start a server, which chooses a free display.
    fn start(size: &str, command: impl FnOnce(&str) -> String) -> Self {
        let folder = std::env::temp_dir().join(format!("lightcrafter-xvfb-{}-{size}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let number = folder.join("number");
        let server = command(folder.to_str().unwrap());
        let command = format!("exec {server} -displayfd 3 3>{}", number.display());
        let mut shell = Command::new("sh");
        let child = shell.args(["-c", &command]).stderr(Stdio::null()).spawn().expect("sh");
        let deadline = Instant::now() + Duration::from_secs(20);
        let display = loop {
            let text = fs::read_to_string(&number).unwrap_or_default();
            if text.ends_with('\n') {
                break format!(":{}", text.trim());
            }
            assert!(Instant::now() < deadline, "no X server: apt-get install xvfb xserver-xorg-video-dummy");
            sleep(Duration::from_millis(20));
        };
        Self { child, display, folder }
    }

    fn run(&self, test: &str) {
        let screen = self.folder.join("Xvfb_screen0");
        run_alone(test, |command| command.env("DISPLAY", &self.display).env(SCREEN, screen));
    }
}

/// Run one of the ignored tests in a separate process. A wrong name would run no test and succeed, so the number of
/// passed tests is checked.
fn run_alone(test: &str, surroundings: impl FnOnce(&mut Command) -> &mut Command) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--ignored", "--exact", test, "--nocapture"]).env_remove("WAYLAND_DISPLAY");
    let done = surroundings(&mut command).output().unwrap();
    let said = String::from_utf8_lossy(&done.stdout);
    let complained = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && said.contains("1 passed"), "{test}: {said}\n{complained}");
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn under_xvfb() {
    Server::xvfb("912x1140").run("every_pixel_is_on_the_screen");
    Server::xvfb("1920x1140").run("another_size_is_refused");
    Server::xvfb("1280x720").run("a_projector_of_any_size_gets_its_pixels");
    Server::two_outputs().run("each_of_two_outputs_gets_its_image");
    run_alone("no_display_is_an_error", |command| command.env_remove("DISPLAY"));
}

/// Red, green and blue of the screen. The header of an xwd file is big-endian; its pixels are 32 bit little-endian.
/// What the screen shows, which must have this width and height.
fn screenshot(size_px: (usize, usize)) -> Vec<u8> {
    let file = fs::read(std::env::var_os(SCREEN).map(PathBuf::from).unwrap_or_else(|| Path::new("").into()))
        .unwrap();
    let word = |i: usize| u32::from_be_bytes(file[4 * i..4 * i + 4].try_into().unwrap()) as usize;
    let (header, width, height, bytes_per_line, colours) = (word(0), word(4), word(5), word(12), word(19));
    assert_eq!((width, height), size_px);
    let pixels = &file[header + 12 * colours..];
    let rows = (0..height).flat_map(|y| pixels[y * bytes_per_line..][..4 * width].chunks(4));
    rows.flat_map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect()
}

fn noise(seed: u32) -> Vec<u8> {
    noise_of(IMAGE_BYTES, seed)
}

fn noise_of(bytes: usize, seed: u32) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..bytes).map(|_| next()).collect()
}

#[test]
#[ignore = "run by under_xvfb"]
fn every_pixel_is_on_the_screen() {
    let found = outputs().unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].unfit().is_none(), "{found:?}");
    let mut window = PatternWindow::open(Some(&found[0].name)).unwrap();
    assert_eq!(window.output(), &found[0]);
    assert!(screenshot((912, 1140)).iter().all(|value| *value == 0), "black when opened");
    for seed in 1..4 {
        let image = noise(seed);
        window.show(&image).unwrap();
        assert!(screenshot((912, 1140)) == image, "image {seed} differs");
    }
    let error = window.show(&[0; 3]).unwrap_err();
    assert!(error.to_string().contains("912 x 1140 pixels of red, green, blue"), "{error}");
    let error = PatternWindow::open(Some("HDMI-7")).unwrap_err();
    assert!(matches!(error, Error::Output { .. }) && error.to_string().contains(&found[0].name), "{error}");
    drop(window);
    assert!(PatternWindow::open(None).is_ok(), "the only suitable output, a second time");
}

/// Red, green and blue of 912 x 1140 pixels of the desktop, starting at this column.
fn desktop_from(column: i16) -> Vec<u8> {
    let (connection, screen) = x11rb::connect(None).unwrap();
    let root = connection.setup().roots[screen].root;
    let image =
        connection.get_image(ImageFormat::Z_PIXMAP, root, column, 0, 912, 1140, !0).unwrap().reply().unwrap();
    image.data.chunks(4).flat_map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect()
}

#[test]
#[ignore = "run by under_xvfb"]
fn each_of_two_outputs_gets_its_image() {
    let found = outputs().unwrap();
    let places: Vec<_> = found.iter().map(|output| (output.name.as_str(), output.position_px)).collect();
    assert_eq!(places, [("DUMMY0", (0, 0)), ("DUMMY1", (912, 0))]);
    assert!(PatternWindow::open(None).unwrap_err().to_string().contains("several are suitable"));
    let (left, right) = (noise(10), noise(11));
    // The second output comes first, because a window that ignored its output would appear on the first.
    let mut windows = ["DUMMY1", "DUMMY0"].map(|name| PatternWindow::open(Some(name)).unwrap());
    windows[0].show(&right).unwrap();
    windows[1].show(&left).unwrap();
    assert!(desktop_from(0) == left && desktop_from(912) == right);
}

#[test]
#[ignore = "run by under_xvfb"]
fn another_size_is_refused() {
    let error = PatternWindow::open(None).unwrap_err();
    assert!(error.to_string().contains("no active output is 912 x 1140"), "{error}");
    let name = outputs().unwrap()[0].name.clone();
    let error = PatternWindow::open(Some(&name)).unwrap_err();
    assert!(error.to_string().contains("1920 x 1140 pixels, not 912 x 1140"), "{error}");
}

#[test]
#[ignore = "run by under_xvfb"]
fn a_projector_of_any_size_gets_its_pixels() {
    let mut window = PatternWindow::open_sized(None, (1280, 720)).unwrap();
    assert_eq!(window.size_px(), (1280, 720));
    let image = noise_of(3 * 1280 * 720, 5);
    window.show(&image).unwrap();
    assert!(screenshot((1280, 720)) == image);
    let error = window.show(&[0; IMAGE_BYTES]).unwrap_err().to_string();
    assert!(error.contains("1280 x 720 pixels of red, green, blue"), "{error}");
    let error = PatternWindow::open_sized(None, (1920, 1080)).unwrap_err().to_string();
    assert!(error.contains("no active output is 1920 x 1080"), "{error}");
}

#[test]
#[ignore = "run by under_xvfb"]
fn no_display_is_an_error() {
    for _ in 0..2 {
        let error = outputs().unwrap_err();
        assert!(matches!(error, Error::NoDisplay { .. }) && error.to_string().contains("DISPLAY"), "{error}");
    }
}
