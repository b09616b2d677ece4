//! The public stages, composed by hand, give results that are bit-identical to those of the published decoder.

mod common;

use common::{BAYER, bench, cast_scene, code, decode_planes, noisy};
use ndarray::{Array2, ArrayView2, Axis, Zip};
use quadfringe::condition::{Sample, linearise};
use quadfringe::height::PairTable;
use quadfringe::optics::ProjectorPair;
use quadfringe::rig::{Albedo, Bench, BitDepth, Light, Planes, RenderOptions};
use quadfringe::stages::{
    Absolute, Background, Blocks, Fringes, Limits, Phases, background, block_means, columns_from_phase,
    discard_invalid, fill_gaps, fourier_pair, modulation, modulation_ratio, nearest_turn, repeat_rows,
    row_period_px, two_step, two_step_coarse, unwrap, wrong_order_probability,
};
use quadfringe::{Conditioner, Decoder, Encoding, Options, PublishedOptions, Response, Result, Shot};
use std::sync::Arc;

/// Maps of a shot that was decoded by hand.
struct Maps {
    phase_rad: Array2<f32>,
    column_px: Array2<f32>,
    modulation: Array2<f32>,
    quality: Array2<f32>,
    wrong_order_probability: Array2<f32>,
    blocks: Blocks,
}

/// Means over blocks minus their background, and the background.
struct Means {
    fringes: Array2<f32>,
    level: Array2<f32>,
}

fn means(image: &Array2<f32>, rows: usize, columns: usize, period_px: f64) -> Result<Means> {
    let means = block_means(image.view(), rows, columns)?;
    let level = background(means.view(), Background::MeanEnvelope, period_px / columns as f64)?;
    Ok(Means { fringes: means - &level, level })
}

/// The recipe of `published/mod.rs`, with its steps in functions of this test.
fn by_hand(light: [Array2<f32>; 4], code: &Encoding, table: Option<&PairTable>) -> Result<Maps> {
    let [red, green, blue, infrared] = light;
    let (height, width) = red.dim();
    let numbers = Phases::from_array(code.four_channel_view()?.numbers());
    let period_px = row_period_px(red.view());
    let periods_px = numbers.map(|number| period_px * numbers.quadrature / number);
    let blocks = Blocks::for_periods(periods_px.green as f32, periods_px.infrared as f32, width);
    let pixels = |map: ArrayView2<'_, f32>| repeat_rows(map, blocks.rows, height);
    let red_means = means(&red, blocks.rows, 1, periods_px.quadrature)?;
    let blue_means = means(&blue, blocks.rows, 1, periods_px.quadrature)?;
    let ratio = modulation_ratio(red_means.fringes.view(), blue_means.fringes.view())?.insert_axis(Axis(1));
    let equal_blue = &blue_means.fringes * &ratio;
    let coarse = two_step_coarse(red_means.fringes.view(), equal_blue.view())?;
    let red = red - pixels(red_means.level.view())?;
    let blue = (blue - pixels(blue_means.level.view())?) * pixels(ratio.view())?;
    let wrapped = two_step(red.view(), blue.view())?;
    let fourier = |image: &Array2<f32>, period_px: f64| means(image, blocks.rows, blocks.columns, period_px);
    let green = fourier(&green, periods_px.green)?;
    let filled = fourier(&fill_gaps(infrared.view()), periods_px.infrared)?;
    let period = |period_px: f64| period_px / blocks.columns as f64;
    let green = Fringes { means: green.fringes.view(), period: period(periods_px.green) };
    let filled = Fringes { means: filled.fringes.view(), period: period(periods_px.infrared) };
    let [green, ir] = fourier_pair(green, filled, blocks.columns, width)?;
    let phases =
        Phases { quadrature: coarse.view(), green: green.phase_rad.view(), infrared: ir.phase_rad.view() };
    let means = match table {
        Some(table) => table.unwrap_blocks(phases, blocks.rows)?,
        None => unwrap(code, phases)?,
    };
    let phase_rad = nearest_turn(wrapped.view(), pixels(means.phase_rad.view())?.view())?;
    let absolute = Absolute::new(phase_rad, pixels(means.margin.view())?)?;
    let mut modulation = modulation(red.view(), blue.view())?;
    let (green, ir) = (pixels(green.modulation.view())?, pixels(ir.modulation.view())?);
    Zip::from(&mut modulation).and(&green).and(&ir).for_each(|least, a, b| *least = least.min(*a).min(*b));
    Zip::from(&mut modulation).and(&infrared).for_each(|least, ir| {
        if ir.is_nan() {
            *least = f32::NAN;
        }
    });
    let (modulation_min, quality_min) = (0.02, Options::default().quality_min);
    let valid = discard_invalid(&absolute, modulation.view(), Limits { modulation_min, quality_min })?;
    let columns = columns_from_phase(code, valid.phase_rad.view());
    let mut wrong_order_probability = wrong_order_probability(valid.quality.view());
    Zip::from(&mut wrong_order_probability).and(&columns.phase_rad).for_each(|wrong, phase| {
        if phase.is_nan() {
            *wrong = f32::NAN;
        }
    });
    Ok(Maps {
        phase_rad: columns.phase_rad,
        column_px: columns.column_px,
        modulation,
        quality: valid.quality,
        wrong_order_probability,
        blocks,
    })
}

fn light_of(planes: &Planes, conditioner: &Conditioner) -> Result<[Array2<f32>; 4]> {
    fn four<T: Sample>(planes: &[Array2<T>; 4], conditioner: &Conditioner) -> Result<[Array2<f32>; 4]> {
        linearise(&Shot::try_from(planes)?, conditioner)
    }
    fn bayer<T: Sample>([raw, ir]: &[Array2<T>; 2], conditioner: &Conditioner) -> Result<[Array2<f32>; 4]> {
        linearise(&Shot::bayer(raw.view(), BAYER, ir.view())?, conditioner)
    }
    match planes {
        Planes::U8(planes) => four(planes, conditioner),
        Planes::U16(planes) => four(planes, conditioner),
        Planes::F32(planes) => four(planes, conditioner),
        Planes::BayerU8(planes) => bayer(planes, conditioner),
        Planes::BayerU16(planes) => bayer(planes, conditioner),
        Planes::BayerF32(planes) => bayer(planes, conditioner),
    }
}

/// Bits of a map for comparison, where all NaN are equal.
fn bits(map: &Array2<f32>) -> Array2<u32> {
    map.mapv(|value| if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() })
}

/// Decodes in both ways and compares every map. Returns the size of the blocks and the number of pixels with data.
fn compare(
    name: &str,
    planes: &Planes,
    code: &Encoding,
    conditioner: &Conditioner,
    table: Option<PairTable>,
) -> (Blocks, usize) {
    let (rows, columns) = planes.shape();
    let mut published = PublishedOptions::default();
    published.along_rays = table.clone().map(Arc::new);
    let options = Options::default().with_method(published);
    let builder = Decoder::builder(code, [rows, columns]).conditioner(conditioner.clone()).options(options);
    let mut decoder = builder.build().expect("valid options");
    let decoded = decode_planes(&mut decoder, planes).expect("a valid shot");
    let light = light_of(planes, conditioner).expect("a valid shot");
    let found = by_hand(light, code, table.as_ref()).expect("fringes along the rows");
    let maps = [
        ("phase", &found.phase_rad, &decoded.phase_rad),
        ("column", &found.column_px, &decoded.column_px),
        ("modulation", &found.modulation, &decoded.modulation),
        ("quality", &found.quality, &decoded.quality),
        ("wrong order", &found.wrong_order_probability, &decoded.wrong_order_probability),
    ];
    for (map, by_hand, decoded) in maps {
        let differing = bits(by_hand).iter().zip(&bits(decoded)).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "{name}, {map}: {differing} pixels differ");
    }
    (found.blocks, decoded.phase_rad.iter().filter(|phase| phase.is_finite()).count())
}

fn render(bench: &Bench, scene: &str, options: &RenderOptions) -> Planes {
    let lights = Light::shot(&code()).expect("four channels");
    bench.render(&cast_scene(bench, scene), &lights, options).expect("a valid scene")
}

#[test]
fn stages_give_the_bits_of_the_decoder_for_scenes_of_every_size_of_blocks() {
    let mut widths = Vec::new();
    for (scene, shrink, seed) in
        [("plane", 1, 1), ("face", 2, 2), ("steps", 3, 3), ("sphere", 4, 4), ("peaks", 2, 5)]
    {
        let bench = bench(shrink);
        let planes = render(&bench, scene, &noisy(seed));
        let (blocks, returned) = compare(scene, &planes, &code(), &Conditioner::default(), None);
        assert!(returned > 1000, "{scene}: {returned}");
        widths.push(blocks.columns);
    }
    let coarse = Encoding::optimum(16, 912).expect("a valid encoding");
    let bench = bench(1);
    let cast = cast_scene(&bench, "face");
    let lights = Light::shot(&coarse).expect("four channels");
    let planes = bench.render(&cast, &lights, &noisy(6)).expect("a valid scene");
    let (blocks, returned) = compare("coarse", &planes, &coarse, &Conditioner::default(), None);
    assert!(returned > 1000, "{returned}");
    widths.push(blocks.columns);
    for columns in [1, 2, 4] {
        assert!(widths.contains(&columns), "no shot with blocks of {columns}: {widths:?}");
    }
}

#[test]
fn stages_give_the_bits_of_the_decoder_with_a_calibration() {
    let bench = bench(2);
    let mut crosstalk = Conditioner::default().crosstalk;
    (crosstalk[0][1], crosstalk[1][2], crosstalk[3][0]) = (0.08, 0.05, 0.02);
    let response = |exponent: f32| [Response { exponent, ..Response::default() }; 4];
    let conditioner = Conditioner::default()
        .with_dark([0.01, 0.02, 0.015, 0.005])
        .with_response(response(1.1))
        .with_crosstalk(crosstalk)
        .with_projector_response(response(0.8))
        // The infrared chip does not see part of the image.
        .with_ir_registration([[1.001, 0.002, 3.4], [-0.002, 0.999, -2.3]]);
    for (depth, scene) in [(BitDepth::Eight, "face"), (BitDepth::Twelve, "steps"), (BitDepth::Float, "hand")]
    {
        let options = RenderOptions {
            bit_depth: depth,
            albedo: Albedo::Patches { side_mm: 20.0, albedo: [0.9; 4] },
            ..noisy(7)
        };
        let (_, returned) = compare(scene, &render(&bench, scene, &options), &code(), &conditioner, None);
        assert!(returned > 1000, "{scene}: {returned}");
    }
    let options = RenderOptions { bayer: Some(BAYER), ..noisy(8) };
    let planes = render(&bench, "face", &options);
    let (_, returned) = compare("mosaic", &planes, &code(), &conditioner, None);
    assert!(returned > 1000, "{returned}");
}

#[test]
fn stages_give_the_bits_of_the_decoder_along_the_camera_rays() {
    let bench = bench(2).deviated([1f64.to_radians(); 3], [0.5; 3]).expect("finite");
    let pair = ProjectorPair::new(bench.visible.clone(), bench.infrared.clone());
    let table = PairTable::new(&bench.camera, &pair, &code(), Some([600.0, 1000.0])).expect("valid pair");
    let planes = render(&bench, "face", &noisy(9));
    let (_, returned) = compare("rays", &planes, &code(), &Conditioner::default(), Some(table));
    assert!(returned > 1000, "{returned}");
}
