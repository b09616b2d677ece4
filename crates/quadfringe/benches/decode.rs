//! Times of the whole of both methods and of each stage, on one shot of the virtual bench: 1024 x 768, 8 bit, 3 % noise.
//!
//! ```text
//! cargo bench -p quadfringe                      everything
//! cargo bench -p quadfringe -- shot              whole shots only
//! RAYON_NUM_THREADS=1 cargo bench -p quadfringe  one thread
//! ```

use criterion::{Criterion, criterion_group, criterion_main};
use ndarray::Array2;
use quadfringe::condition::linearise;
use quadfringe::demod::{self, Background, Band};
use quadfringe::height::Triangulator;
use quadfringe::rig::{Bench, Light, Planes, RenderOptions};
use quadfringe::{
    BayerPattern, Conditioner, Decoder, FringeCode, Method, Options, Result, Shot, surface, unwrap,
};
use std::hint::black_box;

/// Fringe period of the reference bench in camera pixels.
const PERIOD_PX: f64 = 25.6;

struct Scene {
    bench: Bench,
    code: FringeCode,
    planes: [Array2<u8>; 4],
}

impl Scene {
    fn new() -> Result<Self> {
        let (bench, code) = (Bench::reference(), FringeCode::optimum(36, 912)?);
        let cast = bench.cast(surface::scene("face", 0.0)?.as_ref());
        let options = RenderOptions { noise: 0.03, ..RenderOptions::default() };
        let Planes::U8(planes) = bench.render(&cast, &Light::shot(&code), &options)? else {
            unreachable!("the reference camera has 8 bits")
        };
        Ok(Self { bench, code, planes })
    }

    fn shot(&self) -> Result<Shot<'_, u8>> {
        Shot::new(self.planes.each_ref().map(|map| map.view()))
    }

    fn shape(&self) -> [usize; 2] {
        [self.planes[0].nrows(), self.planes[0].ncols()]
    }

    fn triangulator(&self) -> Result<Triangulator> {
        Triangulator::new(&self.bench.camera, &self.bench.visible)
    }

    fn decoder(&self, method: Method) -> Result<Decoder> {
        let options = Options { method, ..Options::default() };
        let decoder = Decoder::new(self.code.clone(), self.shape(), &Conditioner::default(), options)?;
        decoder.triangulate_with(self.triangulator()?)
    }
}

/// From bytes to phase, order, quality and X, Y, Z, into maps made before.
fn whole_shots(c: &mut Criterion) {
    let scene = Scene::new().expect("the reference bench renders");
    let mut group = c.benchmark_group("shot");
    group.sample_size(30);
    for (name, method) in [("published", Method::Published), ("best", Method::Best)] {
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
    let turned = Conditioner {
        ir_registration: [[1.002, -0.0044, 0.37], [0.0044, 1.002, -1.62]],
        ..Conditioner::default()
    };
    let registered = || linearise(black_box(&shot), &turned);
    group.bench_function("conditioning with registration", |b| b.iter(registered));
    group.bench_function("carrier", |b| b.iter(|| demod::carrier(black_box(red.view()))));
    for (name, kind) in [("mean envelope", Background::MeanEnvelope), ("moving mean", Background::MovingMean)]
    {
        group.bench_function(name, |b| b.iter(|| demod::background(black_box(red.view()), kind, PERIOD_PX)));
    }
    group.bench_function("two-step", |b| b.iter(|| demod::two_step(black_box(red.view()), blue.view())));
    let improved = |image| demod::fourier(image, Band::Improved, Background::MeanEnvelope, PERIOD_PX);
    group.bench_function("improved Fourier", |b| b.iter(|| improved(black_box(green.view()))));
    let wrapped = [&red, &green, &infrared].map(|light| improved(light.view()).expect("a fair period"));
    let maps = wrapped.each_ref().map(|map| map.view());
    group.bench_function("ladder", |b| b.iter(|| unwrap::unwrap(&scene.code, black_box(maps))));
    let triangulator = scene.triangulator().expect("the reference bench is calibrated");
    let columns = Array2::from_shape_fn(scene.shape(), |(_, x)| 100.0 + 0.7 * x as f32);
    group.bench_function("triangulation", |b| b.iter(|| triangulator.xyz_mm(black_box(columns.view()))));
    group.finish();
}

criterion_group!(benches, whole_shots, stages);
criterion_main!(benches);
