//! Times of both methods and of each stage, on one shot of the virtual bench: 1024 x 768, 8 bit, 3 % noise. They are
//! compared with the floor, which is the time of the transforms and memory traffic that every Fourier decoder needs.
//! For the ratios, which are printed at the end, methods and floor run alternately, so that the ratios are right also
//! on a busy machine.
//!
//! ```text
//! cargo bench -p quadfringe                      everything
//! cargo bench -p quadfringe -- shot              whole shots and ratios only
//! RAYON_NUM_THREADS=1 cargo bench -p quadfringe  one thread
//! ```

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array2;
use quadfringe::condition::linearise;
use quadfringe::height::Triangulator;
use quadfringe::rig::{Bench, Light, RenderOptions};
use quadfringe::stages::{self, Background, Band, Phases};
use quadfringe::{
    BayerPattern, Conditioner, Decoded, Decoder, Encoding, Method, Options, Result, Shot, surface,
};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// Fringe period of the reference bench in camera pixels.
const PERIOD_PX: f64 = 25.6;

struct Scene {
    bench: Bench,
    encoding: Encoding,
    planes: [Array2<u8>; 4],
}

impl Scene {
    fn new() -> Result<Self> {
        let (bench, encoding) = (Bench::reference(), Encoding::optimum(36, 912)?);
        let cast = bench.cast(surface::scene("face", 0.0)?.as_ref());
        let options = RenderOptions { noise: 0.03, ..RenderOptions::default() };
        let planes = bench.render(&cast, &Light::shot(&encoding)?, &options)?.into_u8()?;
        Ok(Self { bench, encoding, planes })
    }

    fn shot(&self) -> Result<Shot<'_, u8>> {
        Shot::try_from(&self.planes)
    }

    fn shape(&self) -> [usize; 2] {
        [self.planes[0].nrows(), self.planes[0].ncols()]
    }

    /// Makes maps with the size of the scene.
    fn maps(&self) -> Result<Decoded> {
        self.decoder(Method::published())?.decode(&self.shot()?)
    }

    fn triangulator(&self) -> Result<Triangulator> {
        Triangulator::new(&self.bench.camera, &self.bench.visible)
    }

    fn decoder(&self, method: Method) -> Result<Decoder> {
        let options = Options::default().with_method(method);
        let builder = Decoder::builder(&self.encoding, self.shape()).options(options);
        builder.triangulator(self.triangulator()?).build()
    }
}

/// The work that every Fourier decoder must do: transform every row of two channels forward and back, read every byte
/// of a shot, and write every byte of its maps once.
struct Floor {
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl Floor {
    fn new(width: usize) -> Self {
        let mut planner = RealFftPlanner::new();
        Self { forward: planner.plan_fft_forward(width), inverse: planner.plan_fft_inverse(width) }
    }

    fn run(&self, planes: &[Array2<u8>; 4], out: &mut Decoded) {
        let width = planes[0].ncols();
        let maps = [&mut out.phase_rad, &mut out.column_px, &mut out.quality, &mut out.modulation];
        let [green, infrared, red, blue] = maps.map(|map| rows_of(map.as_slice_mut(), width));
        let wrong = rows_of(out.wrong_order_probability.as_slice_mut(), width);
        let xyz = rows_of(out.xyz_mm.as_mut().and_then(|xyz| xyz.as_slice_mut()), 3 * width);
        let rows = green.zip(infrared).zip(red.zip(blue)).zip(wrong.zip(xyz)).enumerate().with_min_len(8);
        rows.for_each_init(
            || (self.forward.make_input_vec(), self.forward.make_output_vec(), self.scratch()),
            |(row, spectrum, scratch), (y, (((green, infrared), (red, blue)), (wrong, xyz)))| {
                let seen = planes.each_ref().map(|plane| plane.row(y).to_slice().expect("whole rows"));
                for (raw, out) in [(seen[1], &mut *green), (seen[3], &mut *infrared)] {
                    copy(raw, row);
                    self.forward.process_with_scratch(row, spectrum, scratch).expect("planned lengths");
                    self.inverse.process_with_scratch(spectrum, row, scratch).expect("planned lengths");
                    out.copy_from_slice(row);
                }
                copy(seen[0], red);
                copy(seen[2], blue);
                wrong.copy_from_slice(red);
                xyz.chunks_exact_mut(width)
                    .zip([green, infrared, blue])
                    .for_each(|(x, y)| x.copy_from_slice(y));
            },
        );
    }

    fn scratch(&self) -> Vec<realfft::num_complex::Complex32> {
        let length = self.forward.get_scratch_len().max(self.inverse.get_scratch_len());
        vec![Default::default(); length]
    }
}

fn rows_of(map: Option<&mut [f32]>, width: usize) -> rayon::slice::ChunksExactMut<'_, f32> {
    map.expect("maps in standard layout").par_chunks_exact_mut(width)
}

fn copy(raw: &[u8], out: &mut [f32]) {
    raw.iter().zip(out).for_each(|(raw, out)| *out = f32::from(*raw));
}

fn floor(c: &mut Criterion) {
    let scene = Scene::new().expect("the reference bench renders");
    let (floor, maps) = (Floor::new(scene.shape()[1]), scene.maps());
    let mut out = maps.expect("the reference bench is calibrated");
    let mut group = c.benchmark_group("floor");
    group.sample_size(30);
    group
        .bench_function("transforms and bytes", |b| b.iter(|| floor.run(black_box(&scene.planes), &mut out)));
    group.finish();
}

/// Ratios of each method to the floor, and to itself on one thread, from the least times of many runs.
fn ratios(_: &mut Criterion) {
    const TURNS: usize = 40;
    let scene = Scene::new().expect("the reference bench renders");
    let shot = scene.shot().expect("four images of one size");
    let floor = Floor::new(scene.shape()[1]);
    let mut out = scene.maps().expect("the reference bench is calibrated");
    let pools = [1, 2].map(|n| ThreadPoolBuilder::new().num_threads(n).build().expect("threads"));
    for method in [Method::published(), Method::joint()] {
        let name = method.name();
        let mut decoder = scene.decoder(method).expect("the reference bench is calibrated");
        let mut least = [[f64::INFINITY; 2]; 2];
        for _ in 0..TURNS {
            for (pool, least) in pools.iter().zip(&mut least) {
                let decoded = pool.install(|| decoder.decode_into(&shot, &mut out));
                decoded.expect("a shot of the decoder's size");
                least[0] = least[0].min(milliseconds(|| {
                    pool.install(|| decoder.decode_into(&shot, &mut out)).expect("as before");
                }));
                pool.install(|| floor.run(&scene.planes, &mut out));
                least[1] = least[1].min(milliseconds(|| pool.install(|| floor.run(&scene.planes, &mut out))));
            }
        }
        let [[one, floor_one], [two, floor_two]] = least;
        println!(
            "{name}: {one:.2} ms on one thread, {:.2} times the floor; {two:.2} ms on two, {:.2} times the floor; \
             one to two threads {:.2} times",
            one / floor_one,
            two / floor_two,
            one / two
        );
    }
}

fn milliseconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    1e3 * start.elapsed().as_secs_f64()
}

/// Times of whole shots, from bytes to phase, order, quality and X, Y, Z, written into existing maps.
fn whole_shots(c: &mut Criterion) {
    let scene = Scene::new().expect("the reference bench renders");
    let mut group = c.benchmark_group("shot");
    group.sample_size(30);
    for (name, method) in [("published", Method::published()), ("joint", Method::joint())] {
        let mut decoder = scene.decoder(method).expect("the reference bench is calibrated");
        let shot = scene.shot().expect("four images of one size");
        let mut out = decoder.decode(&shot).expect("a shot of the decoder's size");
        group.bench_function(name, |b| b.iter(|| decoder.decode_into(black_box(&shot), &mut out)));
    }
    group.finish();
}

fn stages(c: &mut Criterion) {
    let scene = Scene::new().expect("the reference bench renders");
    let shot = scene.shot().expect("four images of one size");
    let lights = || linearise(black_box(&shot), &Conditioner::default());
    let [red, green, blue, infrared] = lights().expect("the default conditioner is valid");
    let mut group = c.benchmark_group("stage");
    group.sample_size(30);
    group.bench_function("conditioning", |b| b.iter(lights));
    let raw = Shot::bayer(scene.planes[1].view(), BayerPattern::Rggb, scene.planes[3].view());
    let raw = raw.expect("two images of one size");
    let of_mosaic = || linearise(black_box(&raw), &Conditioner::default());
    group.bench_function("conditioning of a mosaic", |b| b.iter(of_mosaic));
    let turned =
        Conditioner::default().with_ir_registration([[1.002, -0.0044, 0.37], [0.0044, 1.002, -1.62]]);
    let registered = || linearise(black_box(&shot), &turned);
    group.bench_function("conditioning with registration", |b| b.iter(registered));
    group.bench_function("carrier", |b| b.iter(|| stages::carrier(black_box(red.view()))));
    for (name, kind) in [("mean envelope", Background::MeanEnvelope), ("moving mean", Background::MovingMean)]
    {
        group.bench_function(name, |b| b.iter(|| stages::background(black_box(red.view()), kind, PERIOD_PX)));
    }
    group.bench_function("two-step", |b| b.iter(|| stages::two_step(black_box(red.view()), blue.view())));
    let improved = |image| stages::fourier(image, Band::Improved, Background::MeanEnvelope, PERIOD_PX);
    group.bench_function("improved Fourier", |b| b.iter(|| improved(black_box(green.view()))));
    let wrapped = [&red, &green, &infrared].map(|light| improved(light.view()).expect("a fair period"));
    let maps = wrapped.each_ref().map(|map| map.view());
    group.bench_function("ladder", |b| {
        b.iter(|| stages::unwrap(&scene.encoding, black_box(Phases::from_array(maps))))
    });
    let triangulator = scene.triangulator().expect("the reference bench is calibrated");
    let columns = Array2::from_shape_fn(scene.shape(), |(_, x)| 100.0 + 0.7 * x as f32);
    group.bench_function("triangulation", |b| b.iter(|| triangulator.xyz_mm(black_box(columns.view()))));
    group.finish();
}

criterion_group!(benches, whole_shots, floor, stages, ratios);
criterion_main!(benches);
