//! The thread of the event loop: it carries out orders and paints the windows.

use super::{Output, choose, scaling};
use crate::error::{Error, Result};
use softbuffer::{Context, Surface};
use std::collections::HashMap;
use std::num::NonZeroU32;
use std::rc::Rc;
use std::sync::mpsc::{self, Sender};
use std::sync::{Mutex, OnceLock};
use std::thread;
use std::time::Duration;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy, OwnedDisplayHandle};
use winit::monitor::MonitorHandle;
use winit::platform::wayland::ActiveEventLoopExtWayland;
use winit::platform::x11::{EventLoopBuilderExtX11, MonitorHandleExtX11, WindowAttributesExtX11};
use winit::window::{Fullscreen, Window, WindowId};

/// Time limit of an order, because a compositor may never give a window its size.
const PATIENCE: Duration = Duration::from_secs(5);

type Reply<T> = Sender<Result<T>>;

/// An order to the thread.
pub enum Order {
    Outputs(Reply<Vec<Output>>),
    Open { name: Option<String>, size_px: (u32, u32), reply: Reply<(u64, Output)> },
    Show { number: u64, pixels: Vec<u32>, reply: Reply<()> },
    Close { number: u64, reply: Reply<()> },
}

/// Send an order and wait for the answer.
pub fn ask<T>(order: impl FnOnce(Reply<T>) -> Order) -> Result<T> {
    static THREAD: OnceLock<std::result::Result<Mutex<EventLoopProxy<Order>>, String>> = OnceLock::new();
    let lost = |reason: &str| Error::NoDisplay { reason: reason.to_owned() };
    let proxy = THREAD.get_or_init(start).as_ref().map_err(|reason| lost(reason))?;
    let (reply, answer) = mpsc::channel();
    let sent = proxy.lock().is_ok_and(|proxy| proxy.send_event(order(reply)).is_ok());
    if !sent {
        return Err(lost("the connection to the display is closed"));
    }
    answer.recv_timeout(PATIENCE).unwrap_or_else(|_| Err(lost(&silent())))
}

fn start() -> std::result::Result<Mutex<EventLoopProxy<Order>>, String> {
    let (ready, started) = mpsc::channel();
    let run = move || {
        let event_loop: EventLoop<Order> = match EventLoop::with_user_event().with_any_thread(true).build() {
            Ok(event_loop) => event_loop,
            Err(error) => return drop(ready.send(Err(reason(error)))),
        };
        let _ = ready.send(Ok(Mutex::new(event_loop.create_proxy())));
        // When the display closes, the thread ends, and `ask` reports it.
        let _ = event_loop.run_app(&mut Panes::default());
    };
    let thread = thread::Builder::new().name("pattern windows".into()).spawn(run);
    thread.map_err(|error| error.to_string())?;
    started.recv_timeout(PATIENCE).map_err(|_| silent())?
}

fn silent() -> String {
    format!("the display did not answer within {} s", PATIENCE.as_secs())
}

/// Error text of the window system without the source location that winit puts before it.
fn reason(error: impl std::fmt::Display) -> String {
    let text = error.to_string();
    let words = text.strip_prefix("os error at ").and_then(|rest| rest.split_once(": "));
    words.map_or(text.as_str(), |(_, words)| words).trim_end_matches('.').to_owned()
}

/// A window, its pixels, and the caller that waits for it.
struct Pane {
    window: Rc<Window>,
    surface: Surface<OwnedDisplayHandle, Rc<Window>>,
    size: PhysicalSize<u32>,
    pixels: Vec<u32>,
    waiting: Option<Reply<()>>,
    output: Output,
    wayland: bool,
}

#[derive(Default)]
struct Panes {
    panes: HashMap<u64, Pane>,
    last: u64,
}

fn output(monitor: &MonitorHandle, wayland: bool) -> Output {
    let (size, position) = (monitor.size(), monitor.position());
    let scale = monitor.scale_factor();
    let scaling = match wayland {
        true if scale != 1.0 => Some(format!("scaled by {scale}: set its scale to 1")),
        true => None,
        false => scaling::of_crtc(monitor.native_id()),
    };
    Output {
        name: monitor.name().unwrap_or_default(),
        position_px: (position.x, position.y),
        size_px: (size.width, size.height),
        frame_rate_hz: monitor.refresh_rate_millihertz().map(|rate| f64::from(rate) / 1000.0),
        scaling,
    }
}

fn no_display(error: impl std::fmt::Display) -> Error {
    Error::NoDisplay { reason: reason(error) }
}

impl Panes {
    fn open(
        &mut self,
        events: &ActiveEventLoop,
        name: Option<&str>,
        size_px: (u32, u32),
    ) -> Result<(u64, Output)> {
        let wayland = events.is_wayland();
        let mut monitors: Vec<MonitorHandle> = events.available_monitors().collect();
        let mut outputs: Vec<Output> = monitors.iter().map(|monitor| output(monitor, wayland)).collect();
        let chosen = choose(&outputs, name, size_px)?;
        let (monitor, output) = (monitors.swap_remove(chosen), outputs.swap_remove(chosen));
        let size = PhysicalSize::new(size_px.0, size_px.1);
        let mut attributes = Window::default_attributes()
            .with_title(format!("quadfringe pattern on {}", output.name))
            .with_decorations(false)
            .with_resizable(false)
            .with_inner_size(size)
            .with_position(monitor.position())
            // On X11 this keeps the window manager from moving, scaling or covering the window.
            .with_override_redirect(true);
        if wayland {
            attributes = attributes.with_fullscreen(Some(Fullscreen::Borderless(Some(monitor))));
        }
        let window = Rc::new(events.create_window(attributes).map_err(no_display)?);
        window.set_cursor_visible(false);
        let context = Context::new(events.owned_display_handle()).map_err(no_display)?;
        let surface = Surface::new(&context, Rc::clone(&window)).map_err(no_display)?;
        self.last += 1;
        let (pixels, waiting) = (Vec::new(), None);
        let pane = Pane { window, surface, size, pixels, waiting, output: output.clone(), wayland };
        self.panes.insert(self.last, pane);
        Ok((self.last, output))
    }

    fn show(&mut self, number: u64, pixels: Vec<u32>, reply: Reply<()>) {
        match self.panes.get_mut(&number) {
            Some(pane) => {
                pane.pixels = pixels;
                pane.waiting = Some(reply);
                pane.paint();
            }
            None => drop(reply.send(Err(no_display("the window was closed")))),
        }
    }

    fn pane_of(&mut self, id: WindowId) -> Option<(u64, &mut Pane)> {
        let (number, pane) = self.panes.iter_mut().find(|(_, pane)| pane.window.id() == id)?;
        Some((*number, pane))
    }
}

impl Pane {
    /// Paint and answer the waiting caller. A new window without its final size is painted again at the next resize.
    fn paint(&mut self) {
        let size = self.window.inner_size();
        let scaled = self.wayland && self.window.scale_factor() != 1.0;
        let result = match size == self.size && !scaled {
            true => self.copy(),
            false if self.waiting.is_some() && self.wayland => return,
            false => Err(self.resized(size)),
        };
        if let Some(reply) = self.waiting.take() {
            let _ = reply.send(result);
        }
    }

    fn resized(&self, size: PhysicalSize<u32>) -> Error {
        let reason = format!("the window became {} x {} pixels", size.width, size.height);
        Error::Output { wanted: self.output.name.clone(), reason, present: self.output.to_string() }
    }

    fn copy(&mut self) -> Result<()> {
        let [width, height] =
            [self.size.width, self.size.height].map(|n| NonZeroU32::new(n).unwrap_or(NonZeroU32::MIN));
        self.surface.resize(width, height).map_err(no_display)?;
        let mut buffer = self.surface.buffer_mut().map_err(no_display)?;
        buffer.copy_from_slice(&self.pixels);
        self.window.pre_present_notify();
        buffer.present().map_err(no_display)?;
        // The next buffer is available only when the server has taken this one.
        self.surface.buffer_mut().map_err(no_display)?;
        Ok(())
    }
}

impl ApplicationHandler<Order> for Panes {
    fn resumed(&mut self, _: &ActiveEventLoop) {}

    fn user_event(&mut self, events: &ActiveEventLoop, order: Order) {
        // The caller may have stopped waiting, so a failed reply is no error.
        match order {
            Order::Outputs(reply) => {
                let wayland = events.is_wayland();
                let outputs = events.available_monitors().map(|monitor| output(&monitor, wayland)).collect();
                drop(reply.send(Ok(outputs)));
            }
            Order::Open { name, size_px, reply } => {
                drop(reply.send(self.open(events, name.as_deref(), size_px)));
            }
            Order::Show { number, pixels, reply } => self.show(number, pixels, reply),
            Order::Close { number, reply } => {
                self.panes.remove(&number);
                drop(reply.send(Ok(())));
            }
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        let Some((number, pane)) = self.pane_of(id) else { return };
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => drop(self.panes.remove(&number)),
            WindowEvent::ScaleFactorChanged { mut inner_size_writer, .. } if !pane.wayland => {
                let _ = inner_size_writer.request_inner_size(pane.size);
            }
            WindowEvent::Resized(_) | WindowEvent::RedrawRequested if !pane.pixels.is_empty() => pane.paint(),
            _ => {}
        }
    }
}
