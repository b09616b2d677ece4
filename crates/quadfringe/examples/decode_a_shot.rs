//! Simulates one shot of the scene of steps, decodes it, and compares the depth with the truth.
//!
//! `cargo run --release --example decode_a_shot [scene]`

use quadfringe::height::Triangulator;
use quadfringe::rig::{Bench, Light, RenderOptions};
use quadfringe::surface::scene;
use quadfringe::{Decoder, Encoding, Shot};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "steps".into());

    // The forward half renders the images that a camera would take.
    let bench = Bench::reference();
    let encoding = Encoding::optimum(36, bench.visible.width)?;
    let cast = bench.cast(scene(&name, 0.0)?.as_ref());
    let render = RenderOptions { noise: 0.03, seed: 1, ..RenderOptions::default() };
    let images = bench.render(&cast, &Light::shot(&encoding)?, &render)?.into_u8()?;

    // The inverse half is planned once and then decodes every shot.
    let (rows, columns) = images[0].dim();
    let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
    let mut decoder = Decoder::builder(&encoding, [rows, columns]).triangulator(triangulator).build()?;
    let shot = Shot::try_from(&images)?;
    decoder.decode(&shot)?;
    let start = Instant::now();
    let decoded = decoder.decode(&shot)?;
    let decode_ms = 1e3 * start.elapsed().as_secs_f64();

    let xyz_mm = decoded.xyz_mm.as_ref().expect("the decoder has a triangulator");
    let (truth_mm, edge_px) = (cast.depth_mm(), cast.edge_distance_px());
    let (mut sum, mut smooth, mut returned) = (0.0, 0usize, 0usize);
    for (at, truth) in truth_mm.indexed_iter() {
        let depth = xyz_mm[[at.0, at.1, 2]];
        if depth.is_finite() {
            returned += 1;
            if edge_px[at] > 28.0 {
                smooth += 1;
                sum += f64::from(depth - truth).powi(2);
            }
        }
    }
    let (row, column) = (rows / 2, columns / 2);
    let [x, y, z] = [0, 1, 2].map(|axis| xyz_mm[[row, column, axis]]);
    println!("{name}: {columns} x {rows} pixels, 3 % noise, 8 bit");
    println!("returned          {:.2} %", 100.0 * returned as f64 / truth_mm.len() as f64);
    println!("depth RMS         {:.4} mm, away from edges", (sum / smooth as f64).sqrt());
    println!("middle pixel      ({x:.2}, {y:.2}, {z:.2}) mm, truth z {:.2}", truth_mm[[row, column]]);
    println!("decoded in        {decode_ms:.1} ms");
    Ok(())
}
