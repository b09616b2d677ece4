//! Encodings, patterns and names.

use super::input::Input;
use super::invariants::refused_clearly;
use quadfringe::encoding::{Axis, ChannelCode, Projector, mirror_column, pattern, step_pattern};
use quadfringe::rig::BitDepth;
use quadfringe::{BayerPattern, Channel, DmdLayout, Encoding, Method};

/// Fringe numbers that decoders are used with.
const USUAL: [([f64; 3], usize); 7] = [
    ([36.0, 35.0, 30.0], 912),
    ([16.0, 15.0, 12.0], 400),
    ([4.0, 3.0, 2.0], 64),
    ([45.714, 42.667, 40.0], 1920),
    ([15.5, 14.5, 12.0], 912),
    ([35.0, 36.0, 30.0], 912),
    ([1.0, 1.0, 1.0], 48),
];

/// A four-channel encoding: one that is used, or one of any numbers.
pub fn four_channels(input: &mut Input<'_>) -> Option<Encoding> {
    let choice = input.below(USUAL.len() + 2);
    let (numbers, width) = match USUAL.get(choice) {
        Some(usual) => *usual,
        None if choice == USUAL.len() => (input.all_near(0.0, 50.0), input.below(256)),
        None => ([(); 3].map(|()| input.any()), input.size()),
    };
    refused_clearly(Encoding::four_channel(numbers, width))
}

pub fn layout(input: &mut Input<'_>) -> DmdLayout {
    input.one_of(&[DmdLayout::Regular, DmdLayout::Diamond])
}

fn any_encoding(input: &mut Input<'_>) -> Option<Encoding> {
    if input.flag() {
        return refused_clearly(Encoding::optimum(input.word() % 4096, input.size()));
    }
    let channels: Vec<_> = (0..input.below(6))
        .map(|_| {
            ChannelCode::new(input.near(0.0, 64.0), input.near(-2.0, 2.0), input.one_of(&Projector::ALL))
        })
        .collect();
    let width = if input.flag() { input.size() } else { 912 };
    refused_clearly(Encoding::new(channels, width))
}

fn check(encoding: &Encoding, input: &mut Input<'_>) {
    let margin = encoding.ambiguity_margin_rad();
    assert!(margin.is_finite() && margin >= 0.3, "{margin}");
    let column = input.within(0.0, encoding.projector_width() as f64);
    assert!(encoding.absolute_phase_rad(column).is_finite());
    assert!((2.0..f64::INFINITY).contains(&encoding.period_px()));
    if let Some(four) = refused_clearly(encoding.four_channel_view()) {
        assert!(four.orders() >= 1);
        assert!(Channel::ALL.iter().all(|channel| four.phase_rad(*channel, column).is_finite()));
        assert!(Method::joint().accepts(encoding).is_ok());
    }
    if encoding.projector_width() < 2000 {
        let images = encoding.patterns(input.below(4), layout(input));
        assert_eq!(images.len(), encoding.channels().len());
        assert!(images.iter().flatten().all(|level| (0.0..=1.0).contains(level)));
    }
}

fn patterns(input: &mut Input<'_>) {
    let (size, axis) = ([input.below(50), input.below(50)], input.one_of(&[Axis::Columns, Axis::Rows]));
    let (number, shift_rad) = (input.any(), input.any());
    if let Some(image) = refused_clearly(step_pattern(number, shift_rad, axis, size, layout(input))) {
        assert_eq!(image.dim(), (size[1], size[0]));
    }
    let code = ChannelCode::new(input.any(), input.any(), input.one_of(&Projector::ALL));
    assert_eq!(pattern(&code, size, layout(input)).dim(), (size[1], size[0]));
    assert!(mirror_column(layout(input), input.size(), input.size()) >= 0.0);
}

pub fn run(input: &mut Input<'_>) {
    if let Some(encoding) = any_encoding(input).or_else(|| four_channels(input)) {
        check(&encoding, input);
    }
    patterns(input);
    let name: String = (0..input.below(8)).map(|_| char::from(input.byte())).collect();
    refused_clearly(BayerPattern::from_name(&name));
    refused_clearly(Method::from_name(&name));
    refused_clearly(BitDepth::from_bits(input.word()));
}
