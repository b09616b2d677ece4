//! The virtual bench: casts, renders, prints and pre-deformed patterns.

use super::code;
use super::devices::{camera_of, projector};
use super::input::Input;
use super::invariants::{refused_clearly, same_on_threads};
use super::surfaces::{pose, surface};
use ndarray::{Array2, Array3};
use quadfringe::rig::{
    Albedo, Axis, Bench, BitDepth, Cast, Demosaic, Light, Planes, Print, Projector, RenderOptions,
};
use quadfringe::{BayerPattern, Device, Encoding};

/// A camera of a few pixels; the reference projectors, or others.
fn bench(input: &mut Input<'_>) -> Option<Bench> {
    let mut bench = Bench::reference_with(code::layout(input));
    let (rows, columns) = (1 + input.below(6), 1 + input.below(8));
    let focal_px = 2.5 * columns as f64;
    let centre_px = [0.5 * columns as f64, 0.5 * rows as f64];
    bench.camera = Device::pinhole(columns, rows, [focal_px; 2], centre_px).expect("a usual camera");
    if input.byte() < 32 {
        bench.camera = camera_of(input, [rows, columns]);
    }
    if input.byte() < 64 {
        let encoding = code::four_channels(input)?;
        bench.visible = projector(input, &encoding);
        bench.infrared = projector(input, &encoding);
    }
    if input.byte() < 64 {
        bench = refused_clearly(bench.deviated(input.all_near(-0.1, 0.1), input.all_near(-5.0, 5.0)))?;
    }
    if input.byte() < 64 {
        let [a, b, c, d] = input.all_near(-0.1, 0.1);
        let [x, y] = input.all_near(-2.0, 2.0);
        bench = refused_clearly(bench.with_infrared_chip([[1.0 + a, b, x], [c, 1.0 + d, y]]))?;
    }
    Some(bench)
}

fn light<'a>(input: &mut Input<'_>, image: &'a Array2<f32>) -> Light<'a> {
    match input.below(3) {
        0 => Light::Uniform(input.near(0.0, 1.0)),
        1 => Light::Fringes {
            number: input.near(0.0, 40.0),
            shift_rad: input.near(-2.0, 2.0),
            axis: input.one_of(&[Axis::Columns, Axis::Rows]),
        },
        _ => Light::Image(image.view()),
    }
}

fn albedo(input: &mut Input<'_>, shape: (usize, usize)) -> Albedo {
    match input.below(3) {
        0 => Albedo::Uniform(input.singles_near(0.0, 1.0)),
        1 => Albedo::Patches { side_mm: input.near(0.0, 20.0), albedo: input.singles_near(0.0, 1.0) },
        _ => Albedo::Image(Array3::from_elem(
            (shape.0, shape.1, input.one_of(&[4, 8, 3])),
            input.near(0.0, 1.0) as f32,
        )),
    }
}

fn options(input: &mut Input<'_>, shape: (usize, usize)) -> RenderOptions {
    let mut options = RenderOptions {
        albedo: albedo(input, shape),
        seed: u64::from(input.word()),
        ..RenderOptions::default()
    };
    options.shading = input.flag();
    if input.flag() {
        (options.ambient, options.gain) = (input.all_near(0.0, 0.2), input.all_near(0.0, 2.0));
        (options.projector_exponent, options.camera_exponent) =
            (input.all_near(0.1, 3.0), input.all_near(0.1, 3.0));
        options.camera_offset = input.all_near(0.0, 0.2);
        options.crosstalk.iter_mut().flatten().for_each(|share| *share += input.near(0.0, 0.2));
    }
    if input.flag() {
        (options.blur_px, options.noise) = (input.near(0.0, 3.0), input.near(0.0, 0.1));
    }
    options.bayer = input.flag().then(|| input.one_of(&BayerPattern::ALL));
    options.demosaic = input.flag().then_some(Demosaic::Bilinear);
    let depths = [BitDepth::Eight, BitDepth::Ten, BitDepth::Twelve, BitDepth::Sixteen, BitDepth::Float];
    options.bit_depth = input.one_of(&depths);
    options
}

fn bits(planes: &quadfringe::Result<Planes>) -> Vec<u32> {
    let of_floats = |images: &[Array2<f32>]| images.iter().flatten().map(|light| light.to_bits()).collect();
    let of_words = |images: &[Array2<u16>]| images.iter().flatten().map(|count| u32::from(*count)).collect();
    let of_bytes = |images: &[Array2<u8>]| images.iter().flatten().map(|count| u32::from(*count)).collect();
    match planes {
        Ok(Planes::F32(images)) => of_floats(images),
        Ok(Planes::BayerF32(images)) => of_floats(images),
        Ok(Planes::U16(images)) => of_words(images),
        Ok(Planes::BayerU16(images)) => of_words(images),
        Ok(Planes::U8(images)) => of_bytes(images),
        Ok(Planes::BayerU8(images)) => of_bytes(images),
        Err(_) => Vec::new(),
    }
}

fn render(input: &mut Input<'_>, bench: &Bench, casts: [&Cast; 3]) {
    let visible = if input.byte() < 32 { [2, 3] } else { [bench.visible.height, bench.visible.width] };
    let image =
        if visible[0] * visible[1] > 50_000 { Array2::zeros(visible) } else { input.map(visible, 0.0, 1.0) };
    let lights = [(); 4].map(|()| light(input, &image));
    let options = options(input, casts[0].shape());
    let full_scale = options.bit_depth.full_scale();
    let planes = same_on_threads(|| bench.render_moving(casts, &lights, &options), bits);
    let Some(planes) = refused_clearly(planes) else { return };
    assert_eq!(planes.shape(), casts[0].shape());
    if let Planes::F32(images) = &planes {
        let inside = |light: &f32| (0.0..=full_scale).contains(light);
        assert!(images.iter().flatten().all(inside), "a pixel is not in 0 to {full_scale}");
    }
    refused_clearly(planes.into_u8());
}

fn truth(cast: &Cast, encoding: &Encoding) {
    let shape = cast.shape();
    let of_phase = [cast.phase_rad(encoding), cast.order(encoding), cast.edge_distance_px(), cast.depth_mm()];
    assert!(of_phase.iter().all(|map| map.dim() == shape) && cast.shadow().dim() == shape);
    let of_projectors = Projector::ALL.map(|projector| [cast.column_px(projector), cast.row_px(projector)]);
    assert!(of_projectors.iter().flatten().all(|map| map.dim() == shape));
    assert_eq!(cast.xyz_mm().dim(), (shape.0, shape.1, 3));
}

fn print(input: &mut Input<'_>, bench: &Bench) -> Option<()> {
    let shape = [input.below(6), input.below(6)];
    let print = Print {
        coverage: input.map(shape, 0.0, 1.0).mapv(|share| share.clamp(0.0, 1.0)),
        pitch_mm: input.near(0.0, 10.0),
        origin_mm: input.all_near(-20.0, 20.0),
        paper: input.singles_near(0.0, 1.0),
        ink: input.singles_near(0.0, 1.0),
        pose: pose(input)?,
    };
    let albedo = refused_clearly(bench.printed(&print))?;
    assert!(albedo.iter().all(|share| share.is_finite() && *share >= 0.0));
    Some(())
}

pub fn run(input: &mut Input<'_>) {
    let Some(bench) = bench(input) else { return };
    if input.byte() < 32 {
        print(input, &bench);
    }
    if input.byte() < 32 {
        let mut small = bench.clone();
        (small.infrared.width, small.infrared.height) = (1 + input.below(9), 1 + input.below(9));
        let image = Array2::zeros([small.visible.height, small.visible.width]);
        let light = light(input, &image);
        if let Some(image) = refused_clearly(small.predeform(&light, input.near(100.0, 1000.0))) {
            assert!(image.iter().all(|level| (0.0..=1.0).contains(level)));
        }
    }
    let Some(first) = surface(input) else { return };
    let cast = bench.cast(first.as_ref());
    if let Some(encoding) = code::four_channels(input) {
        truth(&cast, &encoding);
    }
    let moved = if input.byte() < 32 { surface(input) } else { None };
    let moved = moved.map(|surface| bench.cast(surface.as_ref()));
    render(input, &bench, [&cast, moved.as_ref().unwrap_or(&cast), &cast]);
}
