//! The ambiguity margin: how well the phases of an encoding distinguish projector columns.

use std::f64::consts::{PI, TAU};

/// The two columns that are hardest to distinguish.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Closest {
    /// Their distance in phase space, in rad.
    pub margin_rad: f64,
    /// Their distance in projector columns.
    pub distance_px: f64,
}

/// Among the pairs of columns with the same first phase that lie less than `reach_px` apart, the pair that is closest in
/// all other phases. Two columns have the same first phase if a whole number of its periods lies between them. If there
/// is no such pair, the margin is the greatest distance that phases can have.
pub(super) fn closest_columns(fringe_numbers: &[f64], projector_width: usize, reach_px: f64) -> Closest {
    let [first, others @ ..] = fringe_numbers else { unreachable!("an encoding has channels") };
    let width = projector_width as f64;
    let period_px = width / first;
    let greatest = PI * (others.len().max(1) as f64).sqrt();
    let mut closest = Closest { margin_rad: greatest, distance_px: reach_px };
    for periods in 1.. {
        let distance_px = f64::from(periods) * period_px;
        if distance_px >= reach_px * (1.0 - 1e-12) {
            break;
        }
        let apart = |number: &f64| wrapped(TAU * number * distance_px / width);
        let margin_rad = others.iter().map(apart).fold(0.0, f64::hypot);
        if margin_rad < closest.margin_rad {
            closest = Closest { margin_rad, distance_px };
        }
    }
    closest
}

/// Angle brought to `[-pi, pi]`.
fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

#[cfg(test)]
mod tests {
    use crate::encoding::{ChannelCode, Encoding, Projector};
    use crate::error::Error;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn joint_range_decides() {
        let accepted = [
            ([36.0, 35.0, 30.0], 912),
            ([36.0, 35.0, 34.0], 912),
            ([1920.0 / 42.0, 1920.0 / 45.0, 40.0], 1920),
            ([45.714, 42.667, 40.0], 1920),
            ([1.0, 1.0, 1.0], 912),
        ];
        for (numbers, width) in accepted {
            assert!(Encoding::four_channel(numbers, width).is_ok(), "{numbers:?}");
        }
        for numbers in [[16.0, 8.0, 4.0], [30.0, 30.0, 30.0], [36.0, 34.0, 30.0], [36.0, 36.0, 36.0]] {
            let refused = Encoding::four_channel(numbers, 912);
            assert!(matches!(refused, Err(Error::JointRange { .. })), "{numbers:?}");
        }
        for numbers in [[f64::NAN, 35.0, 30.0], [-1.0, 35.0, 30.0], [456.0, 35.0, 30.0], [0.0, 1.0, 2.0]] {
            let refused = Encoding::four_channel(numbers, 912);
            assert!(matches!(refused, Err(Error::Value { .. })), "{numbers:?}");
        }
    }

    #[test]
    fn margins_of_known_encodings() {
        let optimum = Encoding::optimum(36, 912).expect("valid");
        assert!((optimum.ambiguity_margin_rad() - TAU / 6.0).abs() < 1e-9);
        let captured = Encoding::four_channel([45.714, 42.667, 40.0], 1920).expect("valid");
        assert!((captured.ambiguity_margin_rad() - 0.42).abs() < 0.05);
        assert!(Encoding::optimum(35, 912).is_err());
        assert!(Encoding::optimum(0, 912).is_err());
    }

    #[test]
    fn a_range_of_columns_limits_the_pairs_that_count() {
        // The beat of the captures' numbers repeats after 15 fringes of 42 columns.
        let numbers = [1920.0 / 42.0, 1920.0 / 45.0];
        assert!(matches!(Encoding::rgb(numbers, 1920), Err(Error::JointRange { .. })));
        let within = |columns| Encoding::rgb_within(numbers, 1920, columns);
        let found = within([700.0, 1300.0]).expect("630 columns");
        assert!((found.ambiguity_margin_rad() - TAU / 15.0).abs() < 1e-9);
        assert!(matches!(within([640.0, 1300.0]), Err(Error::JointRange { .. })));
        for range in [[-1.0, 300.0], [700.0, 1921.0], [500.0, 500.0], [500.0, 400.0], [f64::NAN, 300.0]] {
            assert!(matches!(within(range), Err(Error::Value { .. })), "{range:?}");
        }
        let whole = Encoding::rgb([16.0, 15.0], 912).expect("one beat over the field");
        assert!((whole.ambiguity_margin_rad() - TAU / 16.0).abs() < 1e-9);
        assert_eq!(whole.columns_px(), [0.0, 912.0]);
    }

    #[test]
    fn lists_of_channels_are_judged_by_the_phases_that_they_measure() {
        let visible = |number, shift| ChannelCode::new(number, shift, Projector::Visible);
        let three_colours = [visible(36.0, 0.0), visible(35.0, 0.0), visible(30.0, 0.0)];
        let found = Encoding::new(three_colours, 912).expect("all columns differ");
        assert!((found.ambiguity_margin_rad() - TAU / 6.0).abs() < 1e-9);
        // Four steps of one fringe number measure one phase, which repeats over the field. A second fringe number
        // removes the ambiguity.
        let steps = |number| (0..4).map(move |k| visible(number, f64::from(k) * FRAC_PI_2));
        let alone: Vec<_> = steps(36.0).collect();
        assert!(matches!(Encoding::new(alone, 912), Err(Error::JointRange { .. })));
        let both: Vec<_> = steps(16.0).chain(steps(15.0)).collect();
        assert!(Encoding::new(both, 912).is_ok());
        // A single fringe over the whole projector has no ambiguity.
        assert!(Encoding::new([visible(1.0, 0.0)], 912).is_ok());
        assert!(matches!(Encoding::new([], 912), Err(Error::Value { .. })));
        assert!(matches!(Encoding::new([visible(1.0, f64::NAN)], 912), Err(Error::Value { .. })));
    }
}
