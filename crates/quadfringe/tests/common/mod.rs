//! Helpers that render a shot on the virtual bench, decode it, and compare it with the truth.

#![allow(dead_code)] // each test uses its part

use ndarray::Array2;
use proptest::test_runner::{Config as ProptestConfig, RngSeed};
use quadfringe::height::Triangulator;
use quadfringe::rig::{Bench, BitDepth, Cast, Light, Planes, RenderOptions};
use quadfringe::surface::scene;
use quadfringe::{
    BayerPattern, Conditioner, Decoded, Decoder, Device, Encoding, Error, Method, Options, Result, Shot,
};
use std::f32::consts::PI;

/// The Bayer pattern of all mosaics in these tests.
pub const BAYER: BayerPattern = BayerPattern::Grbg;

/// Settings for `count` random cases, which are the same in every run.
pub fn cases(count: u32) -> ProptestConfig {
    ProptestConfig {
        cases: count,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(20_260_101),
        max_shrink_iters: 64,
        ..ProptestConfig::default()
    }
}

/// The reference bench, whose camera has the same field but fewer pixels by the factor `shrink` along a side.
pub fn bench(shrink: usize) -> Bench {
    let whole = Bench::reference();
    let (width, height) = (whole.camera.width / shrink, whole.camera.height / shrink);
    let focal = whole.camera.focal_px.map(|f| f / shrink as f64);
    let centre = [width, height].map(|n| 0.5 * (n as f64 - 1.0));
    let camera = Device::pinhole(width, height, focal, centre).expect("valid camera");
    Bench { camera, ..whole }
}

/// Options for images without noise and nearly without rounding.
pub fn clean() -> RenderOptions {
    RenderOptions { bit_depth: BitDepth::Sixteen, ..RenderOptions::default() }
}

/// Options as in the published test: Gaussian noise of 3 % of full scale, then rounding to 8 bit.
pub fn noisy(seed: u64) -> RenderOptions {
    RenderOptions { noise: 0.03, seed, ..RenderOptions::default() }
}

pub fn code() -> Encoding {
    Encoding::optimum(36, 912).expect("a valid encoding")
}

/// A decoder for the camera of a bench, calibrated to millimetres.
pub fn decoder(bench: &Bench, options: Options) -> Decoder {
    let triangulator = Triangulator::new(&bench.camera, &bench.visible).expect("a valid bench");
    let shape = [bench.camera.height, bench.camera.width];
    let builder = Decoder::builder(&code(), shape).options(options).triangulator(triangulator);
    builder.build().expect("valid options")
}

/// The four images of 8 bit.
pub fn bytes(planes: Planes) -> [Array2<u8>; 4] {
    planes.into_u8().expect("the default bit depth")
}

/// Decodes images that the bench rendered, of the channels of the decoder. A mosaic must have the pattern `BAYER`.
pub fn decode_planes(decoder: &mut Decoder, planes: &Planes) -> Result<Decoded> {
    if !decoder.encoding().four_channel_view()?.has_infrared() {
        return match planes {
            Planes::BayerU8([raw, _]) => decoder.decode(&Shot::bayer_rgb(raw.view(), BAYER)?),
            Planes::BayerU16([raw, _]) => decoder.decode(&Shot::bayer_rgb(raw.view(), BAYER)?),
            Planes::BayerF32([raw, _]) => decoder.decode(&Shot::bayer_rgb(raw.view(), BAYER)?),
            Planes::U8([r, g, b, _]) => decoder.decode(&Shot::rgb([r.view(), g.view(), b.view()])?),
            Planes::U16([r, g, b, _]) => decoder.decode(&Shot::rgb([r.view(), g.view(), b.view()])?),
            Planes::F32([r, g, b, _]) => decoder.decode(&Shot::rgb([r.view(), g.view(), b.view()])?),
        };
    }
    match planes {
        Planes::BayerU8([raw, ir]) => decoder.decode(&Shot::bayer(raw.view(), BAYER, ir.view())?),
        Planes::BayerU16([raw, ir]) => decoder.decode(&Shot::bayer(raw.view(), BAYER, ir.view())?),
        Planes::BayerF32([raw, ir]) => decoder.decode(&Shot::bayer(raw.view(), BAYER, ir.view())?),
        Planes::U8(p) => decoder.decode(&Shot::try_from(p)?),
        Planes::U16(p) => decoder.decode(&Shot::try_from(p)?),
        Planes::F32(p) => decoder.decode(&Shot::try_from(p)?),
    }
}

/// Renders a cast scene and decodes it to millimetres.
pub fn there_and_back(
    bench: &Bench,
    cast: &Cast,
    code: &Encoding,
    render: &RenderOptions,
    method: &Method,
) -> Decoded {
    there_and_back_by(bench, cast, code, render, method, &Conditioner::default())
}

/// As [`there_and_back`], with a conditioner.
pub fn there_and_back_by(
    bench: &Bench,
    cast: &Cast,
    code: &Encoding,
    render: &RenderOptions,
    method: &Method,
    conditioner: &Conditioner,
) -> Decoded {
    let work = || -> std::result::Result<Decoded, Error> {
        let planes = bench.render(cast, &Light::shot(code)?, render)?;
        let (rows, columns) = planes.shape();
        let mut decoder = Decoder::builder(code, [rows, columns])
            .conditioner(conditioner.clone())
            .options(Options::default().with_method(method.clone()))
            .triangulator(Triangulator::new(&bench.camera, &bench.visible)?)
            .build()?;
        decode_planes(&mut decoder, &planes)
    };
    work().expect("a valid scene")
}

pub fn cast_scene(bench: &Bench, name: &str) -> Cast {
    bench.cast(scene(name, 0.0).expect("known scene").as_ref())
}

/// Score of a decoded shot.
#[derive(Debug, Clone, Copy, Default)]
pub struct Score {
    /// Lit pixels.
    pub lit: usize,
    /// Pixels returned, lit or not.
    pub returned: usize,
    /// Returned pixels whose order differs from the truth, or that have no light.
    pub wrong: usize,
    /// Returned pixels in shadow.
    pub in_shadow: usize,
    /// Over the pixels with the right order away from edges.
    pub phase_rms_rad: f64,
    /// Over the pixels with the right order away from edges.
    pub depth_rms_mm: f64,
    /// Number of these pixels.
    pub smooth: usize,
}

impl Score {
    pub fn wrong_share(&self) -> f64 {
        self.wrong as f64 / self.returned.max(1) as f64
    }

    /// Returned lit pixels whose order differs from the truth.
    pub fn wrong_orders(&self) -> usize {
        self.wrong - self.in_shadow
    }

    pub fn returned_share(&self) -> f64 {
        self.returned as f64 / self.lit.max(1) as f64
    }
}

/// Compares a decoded shot with the truth. Smooth parts are more than `far_px` away from any edge.
pub fn score(decoded: &Decoded, cast: &Cast, code: &Encoding, far_px: f32) -> Score {
    let (truth, edge) = (cast.phase_rad(code), cast.edge_distance_px());
    let (depth, shadow) = (cast.depth_mm(), cast.shadow());
    let xyz = decoded.xyz_mm.as_ref().expect("calibrated");
    let mut score = Score::default();
    let (mut phase_sum, mut depth_sum) = (0.0, 0.0);
    for (at, &phase) in decoded.phase_rad.indexed_iter() {
        score.lit += usize::from(truth[at].is_finite());
        if !phase.is_finite() {
            continue;
        }
        score.returned += 1;
        score.in_shadow += usize::from(shadow[at]);
        let error = phase - truth[at];
        if error.is_nan() || error.abs() >= PI {
            score.wrong += 1;
        } else if edge[at] > far_px {
            score.smooth += 1;
            phase_sum += f64::from(error).powi(2);
            depth_sum += f64::from(xyz[[at.0, at.1, 2]] - depth[at]).powi(2);
        }
    }
    let root = |sum: f64| (sum / score.smooth.max(1) as f64).sqrt();
    (score.phase_rms_rad, score.depth_rms_mm) = (root(phase_sum), root(depth_sum));
    score
}
