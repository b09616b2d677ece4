//! Decodes a stream: the camera does not wait for the single decoder, and all shots share the same maps.
//!
//! The camera of this example is the virtual bench, which films a moving hand thirty times a second. It sends every
//! shot through a channel with room for one shot. Like a driver, it drops a shot if the channel is full, so the decoder
//! works on a recent shot and never falls behind. From the second shot on, decoding allocates no memory.
//!
//! `cargo run --release --example decode_a_stream [shots]`

use ndarray::Array2;
use quadfringe::height::Triangulator;
use quadfringe::rig::{Bench, Light, RenderOptions};
use quadfringe::surface::Hand;
use quadfringe::{Decoded, Decoder, Device, Encoding, Shot};
use std::error::Error;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

const FRAME: Duration = Duration::from_millis(33);

/// One exposure of the camera: four images and the instant of the exposure.
struct Frame {
    images: [Array2<u8>; 4],
    time_s: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let shots = std::env::args().nth(1).map_or(Ok(8), |number| number.parse())?;
    let mut bench = Bench::reference();
    bench.camera = Device::pinhole(512, 384, [1290.3; 2], [255.5, 191.5])?;
    let encoding = Encoding::optimum(36, bench.visible.width)?;

    // The decoder is planned and checked once.
    let shape = [bench.camera.height, bench.camera.width];
    let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
    let mut decoder = Decoder::builder(&encoding, shape).triangulator(triangulator).build()?;

    let (sender, frames) = sync_channel(1);
    let camera =
        thread::spawn(move || film(&bench, &encoding, shots, &sender).map_err(|error| error.to_string()));
    follow(&mut decoder, &frames)?;
    let dropped = camera.join().expect("the camera does not panic")?;
    println!("{dropped} of {shots} shots dropped");
    Ok(())
}

/// Decodes shots until the camera stops.
fn follow(decoder: &mut Decoder, frames: &Receiver<Frame>) -> quadfringe::Result<()> {
    let mut maps = Decoded::default();
    for Frame { images, time_s } in frames {
        let start = Instant::now();
        decoder.decode_into(&Shot::try_from(&images)?, &mut maps)?;
        let decode_ms = 1e3 * start.elapsed().as_secs_f64();

        let xyz_mm = maps.xyz_mm.as_ref().expect("the decoder has a triangulator");
        let uncertainty_mm = maps.uncertainty_mm.as_ref().expect("the decoder has a triangulator");
        let valid = maps.wrong_order_probability.indexed_iter().filter(|(_, wrong)| **wrong < 1e-3);
        let depth = |at: (usize, usize)| (xyz_mm[[at.0, at.1, 2]], uncertainty_mm[at]);
        let nearest = valid.map(|(at, _)| depth(at)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((z_mm, sigma_mm)) = nearest {
            println!("{time_s:.3} s: nearest point at {z_mm:.2} mm +- {sigma_mm:.2} mm, {decode_ms:.1} ms");
        }
    }
    Ok(())
}

/// Sends shots at the frame rate. Returns the number of shots that were dropped because the decoder had no time.
fn film(
    bench: &Bench,
    encoding: &Encoding,
    shots: u64,
    sender: &SyncSender<Frame>,
) -> quadfringe::Result<usize> {
    let lights = Light::shot(encoding)?;
    let mut dropped = 0;
    for number in 0..shots {
        let start = Instant::now();
        let time_s = number as f64 * FRAME.as_secs_f64();
        let cast = bench.cast(&Hand::at(time_s)?);
        let render = RenderOptions { noise: 0.02, seed: number, ..RenderOptions::default() };
        let images = bench.render(&cast, &lights, &render)?.into_u8()?;
        match sender.try_send(Frame { images, time_s }) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => dropped += 1,
            Err(TrySendError::Disconnected(_)) => break,
        }
        thread::sleep(FRAME.saturating_sub(start.elapsed()));
    }
    Ok(dropped)
}
