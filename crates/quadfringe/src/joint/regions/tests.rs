use super::super::cells::Grid;
use super::*;
use crate::encoding::Encoding;
use crate::joint::energy::Rows;
use crate::joint::params::regions::QUALITY;

const PERIOD_PX: f32 = 24.0;
const SIDES: [usize; 2] = [96, 192];

/// A strip of a surface whose order is too high, or whose infrared light is another one.
struct Case {
    grid: Grid,
    phase: Vec<f32>,
    light: [Vec<f32>; 4],
    /// What is known of the albedo.
    brightness: Vec<f32>,
}

impl Case {
    /// A plane whose phase is too high by `turns` in a strip of 40 columns, where the infrared fringes lie `shift` rad off. The albedo
    /// changes along the rows and down the columns, and is not known.
    fn new(turns: f32, shift: f32) -> Self {
        Self::painted(turns, shift, |x, y| {
            0.5 + 0.2 * ((x % 13) as f32 / 13.0) + if y / 4 % 2 == 0 { 0.0 } else { 0.1 }
        })
    }

    /// The same with an albedo of the pixel in column `x` of row `y`.
    fn painted(turns: f32, shift: f32, albedo: impl Fn(usize, usize) -> f32) -> Self {
        let grid = Grid::new(SIDES, 4.0);
        let strip = |at: usize| (60..100).contains(&(at % grid.stride));
        let plane = |at: usize| 20.0 + TAU * (at % grid.stride) as f32 / PERIOD_PX;
        // Neighbouring pixels of strip and plane differ by more than half a turn for any number of turns but 0.
        let true_phase = |at: usize| plane(at) + if strip(at) { PERIOD_PX } else { 0.0 };
        let light = |ratio: f32, shift: f32| {
            let cosine = |at: usize| (ratio * true_phase(at) + if strip(at) { shift } else { 0.0 }).cos();
            let albedo = |at: usize| albedo(at % grid.stride, at / grid.stride);
            (0..grid.pixels()).map(|at| albedo(at) * (1.0 + 0.6 * cosine(at))).collect::<Vec<_>>()
        };
        let phase = (0..grid.pixels()).map(|at| true_phase(at) + if strip(at) { TAU * turns } else { 0.0 });
        Self {
            phase: phase.collect(),
            light: [light(1.0, 0.0), light(35.0 / 36.0, 0.0), light(1.0, 0.0), light(30.0 / 36.0, shift)],
            brightness: vec![1.0; grid.pixels()],
            grid,
        }
    }

    /// Turns that the strip and the plane gain, and how certain both are.
    fn settled(&self) -> ([f32; 2], [f32; 2]) {
        let code =
            Encoding::optimum(36, 912).and_then(|code| code.four_channel_view()).expect("valid numbers");
        let usable = vec![1.0; self.grid.pixels()];
        let light = self.light.each_ref().map(Vec::as_slice);
        let scene =
            Scene { light, usable: &usable, grid: &self.grid, period_px: 24.0, factor: 1, pair: None };
        let (mut orders, mut phase) = (RegionOrders::new(&code), self.phase.clone());
        let stride = self.grid.stride;
        let brightness = |y: usize, _: &mut Rows, out: &mut Vec<f32>| {
            out.clear();
            out.extend_from_slice(&self.brightness[y * stride..][..stride]);
        };
        orders.settle(&scene, 0.01, &brightness, &usable, &mut phase);
        let mut certainty = vec![0.0; self.grid.width];
        orders.parts(50, |pixels, found| found.raise(&vec![1.0; pixels.len()], &mut certainty[pixels]));
        let row = 50 * self.grid.stride;
        let gained = [80, 20].map(|x| ((phase[row + x] - self.phase[row + x]) / TAU).round());
        (gained, [80, 20].map(|x| certainty[x]))
    }
}

#[test]
fn a_region_of_a_wrong_order_takes_the_one_that_explains_its_light() {
    for turns in [-2.0, 0.0, 1.0, 5.0] {
        let (gained, certainty) = Case::new(turns, 0.0).settled();
        assert_eq!((gained, certainty), ([-turns, 0.0], [QUALITY; 2]), "{turns}");
    }
}

#[test]
fn a_region_whose_light_no_order_explains_is_doubtful() {
    let (gained, certainty) = Case::new(0.0, 2.6).settled();
    assert_eq!(gained, [0.0; 2]);
    assert_eq!(certainty, [0.0, QUALITY]);
}

#[test]
fn a_print_in_all_channels_speaks_for_no_order_where_the_brightness_is_known() {
    // Bars that are much narrower than a fringe, and a tenth as bright as the paper between them.
    let bars = |x: usize, _: usize| if (x / 7).is_multiple_of(2) { 0.08 } else { 0.8 };
    let mut case = Case::painted(1.0, 0.0, bars);
    let (_, unknown) = case.settled();
    assert!(unknown[0] < QUALITY, "{unknown:?}");
    case.brightness = (0..case.grid.pixels()).map(|at| bars(at % case.grid.stride, 0)).collect();
    assert_eq!(case.settled(), ([-1.0, 0.0], [QUALITY; 2]));
}
