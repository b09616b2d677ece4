//! Times of both methods and of the floor, on one shot of 1024 x 768, 8 bit. The floor is a lower bound for the time of
//! a decoder that filters two channels along rows.
//!
//! The floor reads every byte of the four images, transforms two channels along rows forward (real) and back (complex,
//! because a phase needs the analytic signal), and writes as many bytes as a decoded shot has: eight `f32` for each
//! pixel. It decodes nothing. Floor and methods write into existing maps.
//!
//! ```text
//! cargo bench -p quadfringe --bench floor                medians of 30 rounds in ms, as JSON
//! cargo bench -p quadfringe --bench floor -- --serve     a line `floor`, `published` or `joint` in, its time in ms out
//! RAYON_NUM_THREADS=1 cargo bench ...                    one thread
//! ```

use ndarray::Array2;
use quadfringe::height::Triangulator;
use quadfringe::rig::{Bench, Light, RenderOptions};
use quadfringe::{Decoded, Decoder, Encoding, Method, Options, Shot, surface};
use rayon::prelude::*;
use realfft::{RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};
use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, Write};
use std::sync::Arc;
use std::time::{Duration, Instant};

type Outcome<T> = std::result::Result<T, Box<dyn Error>>;

const ROUNDS: usize = 30;
/// Warm-up before timing: an operating system needs some time to give each woken thread its core.
const WARM: Duration = Duration::from_millis(100);
const FLOATS_PER_PIXEL: usize = 8;
const NAMES: [&str; 3] = ["floor", "published", "joint"];

/// Row transforms and output bytes, without any decoding between them.
struct Floor {
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    columns: usize,
    out: Vec<f32>,
}

/// Working memory of one thread for a row.
struct Scratch {
    real: Vec<f32>,
    half: Vec<Complex32>,
    analytic: [Vec<Complex32>; 2],
    forward: Vec<Complex32>,
    inverse: Vec<Complex32>,
}

impl Floor {
    fn new(rows: usize, columns: usize) -> Self {
        Self {
            forward: RealFftPlanner::new().plan_fft_forward(columns),
            inverse: FftPlanner::new().plan_fft_inverse(columns),
            columns,
            out: vec![0.0; FLOATS_PER_PIXEL * rows * columns],
        }
    }

    fn scratch(&self) -> Scratch {
        Scratch {
            real: self.forward.make_input_vec(),
            half: self.forward.make_output_vec(),
            analytic: [(); 2].map(|()| vec![Complex32::default(); self.columns]),
            forward: self.forward.make_scratch_vec(),
            inverse: vec![Complex32::default(); self.inverse.get_inplace_scratch_len()],
        }
    }

    fn run(&mut self, planes: &[Array2<u8>; 4]) {
        let columns = self.columns;
        let mut out = std::mem::take(&mut self.out);
        let rows = out.par_chunks_mut(FLOATS_PER_PIXEL * columns).enumerate();
        rows.for_each_init(
            || self.scratch(),
            |scratch, (row, out)| {
                let images = planes
                    .each_ref()
                    .map(|plane| &plane.as_slice().expect("images in one piece")[row * columns..]);
                self.analytic_signals([images[1], images[3]], scratch);
                let [green, infrared] = &scratch.analytic;
                for (column, out) in out.chunks_exact_mut(FLOATS_PER_PIXEL).enumerate() {
                    let (a, b) = (green[column], infrared[column]);
                    let [red, green, blue, infrared] = images.map(|image| f32::from(image[column]));
                    out.copy_from_slice(&[red, green, blue, infrared, a.re, a.im, b.re, b.im]);
                }
            },
        );
        self.out = out;
    }

    fn analytic_signals(&self, images: [&[u8]; 2], scratch: &mut Scratch) {
        for (image, analytic) in images.into_iter().zip(&mut scratch.analytic) {
            for (real, count) in scratch.real.iter_mut().zip(image) {
                *real = f32::from(*count);
            }
            let transformed =
                self.forward.process_with_scratch(&mut scratch.real, &mut scratch.half, &mut scratch.forward);
            transformed.expect("buffers made by the plan");
            let (band, rest) = analytic.split_at_mut(scratch.half.len());
            band.copy_from_slice(&scratch.half);
            rest.fill(Complex32::default());
            self.inverse.process_with_scratch(analytic, &mut scratch.inverse);
        }
    }
}

struct Contenders {
    planes: [Array2<u8>; 4],
    floor: Floor,
    methods: [(Decoder, Decoded); 2],
}

impl Contenders {
    fn new() -> Outcome<Self> {
        let (bench, encoding) = (Bench::reference(), Encoding::optimum(36, 912)?);
        let cast = bench.cast(surface::scene("peaks", 0.0)?.as_ref());
        let options = RenderOptions { noise: 0.03, ..RenderOptions::default() };
        let planes = bench.render(&cast, &Light::shot(&encoding)?, &options)?.into_u8()?;
        let (rows, columns) = planes[0].dim();
        let decoder = |method| -> Outcome<(Decoder, Decoded)> {
            let options = Options::default().with_method(method);
            let triangulator = Triangulator::new(&bench.camera, &bench.visible)?;
            let builder = Decoder::builder(&encoding, [rows, columns]).options(options);
            let mut decoder = builder.triangulator(triangulator).build()?;
            let maps = decoder.decode(&Shot::try_from(&planes)?)?;
            Ok((decoder, maps))
        };
        let methods = [decoder(Method::published())?, decoder(Method::joint())?];
        Ok(Self { floor: Floor::new(rows, columns), planes, methods })
    }

    /// Time of one run in ms, after some runs that are not timed.
    fn time_ms(&mut self, name: &str) -> Outcome<f64> {
        let start = Instant::now();
        while start.elapsed() < WARM {
            self.run(name)?;
        }
        let start = Instant::now();
        self.run(name)?;
        Ok(1e3 * start.elapsed().as_secs_f64())
    }

    fn run(&mut self, name: &str) -> Outcome<()> {
        let Some(index) = NAMES.iter().position(|known| *known == name) else {
            return Err(format!("expected one of {}, got {name:?}", NAMES.join(", ")).into());
        };
        if index == 0 {
            self.floor.run(black_box(&self.planes));
            black_box(&self.floor.out);
            return Ok(());
        }
        let (decoder, out) = &mut self.methods[index - 1];
        let shot = Shot::new(self.planes.each_ref().map(|plane| plane.view()))?;
        Ok(decoder.decode_into(black_box(&shot), out)?)
    }
}

fn medians(contenders: &mut Contenders) -> Outcome<String> {
    let mut times_ms = [(); NAMES.len()].map(|()| Vec::with_capacity(ROUNDS));
    for _ in 0..ROUNDS {
        for (name, times_ms) in NAMES.iter().zip(&mut times_ms) {
            times_ms.push(contenders.time_ms(name)?);
        }
    }
    let figure = |(name, times_ms): (&&str, &mut Vec<f64>)| {
        times_ms.sort_by(f64::total_cmp);
        format!("\"{name}_ms\": {:.4}", times_ms[ROUNDS / 2])
    };
    let figures: Vec<_> = NAMES.iter().zip(&mut times_ms).map(figure).collect();
    Ok(format!("{{\"figures\": {{{}}}}}", figures.join(", ")))
}

fn serve(contenders: &mut Contenders) -> Outcome<()> {
    for line in std::io::stdin().lock().lines() {
        println!("{:.6}", contenders.time_ms(line?.trim())?);
        std::io::stdout().flush()?;
    }
    Ok(())
}

fn main() -> Outcome<()> {
    // Cargo adds the argument --bench.
    let given: Vec<_> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let mut contenders = Contenders::new()?;
    match given.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => println!("{}", medians(&mut contenders)?),
        ["--serve"] => serve(&mut contenders)?,
        _ => return Err(format!("expected nothing or --serve, got {}", given.join(" ")).into()),
    }
    Ok(())
}
