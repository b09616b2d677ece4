//! Figures of the joint method on six shots of the virtual bench. To see the effect of a tuned number, run this before
//! and after you change the number in `src/joint/params`, and compare.
//!
//! ```text
//! cargo run --release --example joint_figures
//! ```

use ndarray::Array2;
use quadfringe::height::Triangulator;
use quadfringe::rig::{Albedo, Bench, BitDepth, Cast, Light, Planes, RenderOptions};
use quadfringe::surface::scene;
use quadfringe::{Decoded, Decoder, Encoding, Result, Shot};
use std::f64::consts::PI;

/// Width in pixels of a fringe of the reference bench. A pixel that is further than this from edges counts as smooth.
const FRINGE_PX: f32 = 28.0;

/// Name, surface and render options of each shot.
fn shots() -> [(&'static str, &'static str, RenderOptions); 6] {
    let noisy = |seed| RenderOptions { noise: 0.03, seed, ..RenderOptions::default() };
    let clean = RenderOptions { bit_depth: BitDepth::Sixteen, ..RenderOptions::default() };
    let squares = Albedo::Patches { side_mm: 20.0, albedo: [0.9; 4] };
    let dim = RenderOptions { albedo: Albedo::Uniform([0.35; 4]), ambient: [0.1; 4], ..noisy(9) };
    [
        ("peaks, no noise", "peaks", clean),
        ("peaks", "peaks", noisy(3)),
        ("steps", "steps", noisy(4)),
        ("face", "face", noisy(5)),
        ("textured face", "face", RenderOptions { albedo: squares, ..noisy(6) }),
        ("dim steps", "steps", dim),
    ]
}

fn decode(bench: &Bench, encoding: &Encoding, planes: &Planes) -> Result<Decoded> {
    let (rows, columns) = planes.shape();
    let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
    let mut decoder = Decoder::builder(encoding, [rows, columns]).triangulator(triangulator).build()?;
    match planes {
        Planes::U8(images) => decoder.decode(&Shot::try_from(images)?),
        Planes::U16(images) => decoder.decode(&Shot::try_from(images)?),
        _ => unreachable!("the shots have full images of 8 and 16 bit"),
    }
}

/// Accumulator of a root mean square.
#[derive(Default)]
struct Rms {
    sum: f64,
    count: f64,
}

impl Rms {
    fn add(&mut self, error: f64) {
        self.sum += error * error;
        self.count += 1.0;
    }

    fn value(&self) -> f64 {
        (self.sum / self.count.max(1.0)).sqrt()
    }
}

/// Prints one line of figures.
fn report(name: &str, decoded: &Decoded, cast: &Cast, encoding: &Encoding) {
    let (truth, edge, depth): (Array2<f32>, _, _) =
        (cast.phase_rad(encoding), cast.edge_distance_px(), cast.depth_mm());
    let (xyz, sigma) = (&decoded.xyz_mm, &decoded.uncertainty_mm);
    let (xyz, sigma) = (xyz.as_ref().expect("calibrated"), sigma.as_ref().expect("calibrated"));
    let (mut smooth, mut near) = (Rms::default(), Rms::default());
    let (mut returned, mut wrong, mut promised, mut inside) = (0.0, 0.0, 0.0, 0.0);
    for (at, phase) in decoded.phase_rad.indexed_iter().filter(|(_, phase)| phase.is_finite()) {
        returned += 1.0;
        promised += f64::from(decoded.wrong_order_probability[at]);
        let error = f64::from(phase - truth[at]);
        if error.is_nan() || error.abs() >= PI {
            wrong += 1.0;
        } else if edge[at] > FRINGE_PX {
            smooth.add(error);
            let error_mm = (xyz[[at.0, at.1, 2]] - depth[at]).abs();
            inside += f64::from(u8::from(f64::from(error_mm) < f64::from(sigma[at])));
        } else {
            near.add(error);
        }
    }
    let lit = truth.iter().filter(|phase| phase.is_finite()).count() as f64;
    println!(
        "{name:16} {:8.2} {:10.5} {:10.5} {:8.0} {:9.0} {:8.3}",
        100.0 * returned / lit,
        smooth.value(),
        near.value(),
        1e6 * wrong / returned,
        1e6 * promised / returned,
        inside / smooth.count.max(1.0),
    );
}

fn main() -> Result<()> {
    let (bench, encoding) = (Bench::reference(), Encoding::optimum(36, 912)?);
    println!("returned, % of lit; phase RMS, rad: smooth, near edges; wrong orders, ppm: found, promised;");
    println!("share of smooth errors inside one standard deviation (0.683 of normal errors)");
    for (name, surface, render) in shots() {
        let cast = bench.cast(scene(surface, 0.0)?.as_ref());
        let planes = bench.render(&cast, &Light::shot(&encoding)?, &render)?;
        report(name, &decode(&bench, &encoding, &planes)?, &cast, &encoding);
    }
    Ok(())
}
