//! The encodings that decode a single shot: R and B in quadrature, G alone, and IR alone if there is an infrared
//! projector, as in the paper; or R, G and B, each alone.

use super::Encoding;
use super::channel::{ChannelCode, Projector, phase_at};
use crate::error::{Error, FourChannelFault, Result};
use std::f64::consts::FRAC_PI_2;

/// One of the four channels of a shot, in the order of every four-channel array: R, G, B, IR.
///
/// ```
/// use quadfringe::Channel;
/// assert_eq!(Channel::ALL.map(Channel::name), ["R", "G", "B", "IR"]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Red, visible projector, shift 0: in quadrature with B.
    R,
    /// Green, visible projector, shift 0.
    G,
    /// Blue, visible projector, shift `pi/2`: in quadrature with R. Alone, with another fringe number than R: shift 0.
    B,
    /// Infrared, infrared projector, shift 0.
    Ir,
}

impl Channel {
    /// The channels in array order.
    pub const ALL: [Self; 4] = [Self::R, Self::G, Self::B, Self::Ir];

    /// Index in four-channel arrays: R 0, G 1, B 2, IR 3.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The channel's name in messages and files: R, G, B, IR.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::R => "R",
            Self::G => "G",
            Self::B => "B",
            Self::Ir => "IR",
        }
    }

    /// Phase shift in rad of a channel with infrared: `pi/2` for B, else 0. [`FourChannel::shift_rad`] is that of an encoding.
    #[must_use]
    pub const fn shift_rad(self) -> f64 {
        match self {
            Self::B => FRAC_PI_2,
            _ => 0.0,
        }
    }

    /// The projector that shows the channel.
    #[must_use]
    pub const fn projector(self) -> Projector {
        match self {
            Self::Ir => Projector::Infrared,
            _ => Projector::Visible,
        }
    }
}

/// The encoding of a single shot as decoders see it: two or three phases of different fringe numbers over the projector width, the
/// third of IR, or of B if B is alone. [`Encoding::four_channel_view`] makes it, which guarantees valid numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FourChannel {
    /// Fringe number of R, and of B if the two are in quadrature. Decoding makes this phase absolute.
    pub quadrature: f64,
    /// Fringe number of G.
    pub green: f64,
    /// Fringe number of IR; 0 if there is no infrared channel.
    pub infrared: f64,
    /// Fringe number of B if B is alone; 0 if it is in quadrature with R.
    pub blue: f64,
    /// Number of projector columns that the fringe numbers refer to.
    pub projector_width: usize,
    /// [`Encoding::columns_px`] of the encoding.
    pub columns_px: [f64; 2],
    /// [`Encoding::ambiguity_margin_rad`] of the encoding.
    pub ambiguity_margin_rad: f64,
}

impl FourChannel {
    /// Whether there is an infrared channel.
    #[must_use]
    pub fn has_infrared(&self) -> bool {
        self.infrared > 0.0
    }

    /// Whether R and B are in quadrature; otherwise each of the three colours is alone.
    #[must_use]
    pub fn has_quadrature(&self) -> bool {
        self.blue == 0.0
    }

    /// Fringe number of a channel; 0 for an infrared channel that is absent.
    #[must_use]
    pub fn fringe_number(&self, channel: Channel) -> f64 {
        match channel {
            Channel::B if !self.has_quadrature() => self.blue,
            Channel::R | Channel::B => self.quadrature,
            Channel::G => self.green,
            Channel::Ir => self.infrared,
        }
    }

    /// Phase shift of a channel in rad: `pi/2` for B in quadrature with R, else 0.
    #[must_use]
    pub fn shift_rad(&self, channel: Channel) -> f64 {
        if self.has_quadrature() { channel.shift_rad() } else { 0.0 }
    }

    /// The fringe numbers of the three phases: of R with or without B, of G, and of IR or B alone; the third is 0 if there are
    /// two.
    #[must_use]
    pub fn numbers(&self) -> [f64; 3] {
        [self.quadrature, self.green, if self.has_quadrature() { self.infrared } else { self.blue }]
    }

    /// Whether there is a third phase, of IR or of B alone.
    #[must_use]
    pub fn has_third(&self) -> bool {
        self.numbers()[2] > 0.0
    }

    /// The fringe numbers, over the first, of R, G, B and IR as the steps of the joint method have them; 0 for a channel that is
    /// absent. B alone has the place of IR, because both are a phase other than that of R, and nothing is then in quadrature with R.
    pub(crate) fn ratios(&self) -> [f32; 4] {
        let [first, second, third] = self.numbers().map(|number| (number / self.quadrature) as f32);
        [first, second, if self.has_quadrature() { first } else { 0.0 }, third]
    }

    /// Number of fringe orders of R over the projector width.
    #[must_use]
    pub fn orders(&self) -> usize {
        self.quadrature.ceil() as usize
    }

    /// Number of projector columns in one turn of the absolute phase, which is the phase of R.
    #[must_use]
    pub fn period_px(&self) -> f64 {
        self.projector_width as f64 / self.quadrature
    }

    /// Phase of a channel in rad at a projector column, not wrapped and without the shift of the channel (S1).
    #[must_use]
    pub fn phase_rad(&self, channel: Channel, column_px: f64) -> f64 {
        phase_at(self.fringe_number(channel), column_px, self.projector_width)
    }
}

impl Encoding {
    /// The encoding as the four channels of the paper, as the first three of them, or as three colours of different fringe
    /// numbers and without shifts. The decoders of this crate take only these.
    ///
    /// ```
    /// use quadfringe::Encoding;
    /// use quadfringe::encoding::{ChannelCode, Projector};
    /// let four = Encoding::optimum(36, 912)?.four_channel_view()?;
    /// assert_eq!((four.quadrature, four.green, four.infrared), (36.0, 35.0, 30.0));
    ///
    /// let three_colours = [36.0, 35.0, 30.0].map(|number| ChannelCode::new(number, 0.0, Projector::Visible));
    /// let view = Encoding::new(three_colours, 912)?.four_channel_view()?;
    /// assert_eq!((view.numbers(), view.has_quadrature()), ([36.0, 35.0, 30.0], false));
    ///
    /// let alike = [16.0, 15.0, 15.0].map(|number| ChannelCode::new(number, 0.0, Projector::Visible));
    /// let refused = Encoding::new(alike, 912)?.four_channel_view().unwrap_err();
    /// assert!(refused.to_string().contains("got 15 fringes in G and in another channel"));
    /// # Ok::<(), quadfringe::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::NotFourChannel`], which names the first difference.
    pub fn four_channel_view(&self) -> Result<FourChannel> {
        let fault = |fault| Err(Error::NotFourChannel { fault });
        let [red, green, blue, infrared @ ..] = self.channels() else {
            return fault(FourChannelFault::Count(self.channels().len()));
        };
        if infrared.len() > 1 {
            return fault(FourChannelFault::Count(self.channels().len()));
        }
        let is_alone =
            infrared.is_empty() && blue.shift_rad == 0.0 && blue.fringe_number != red.fringe_number;
        for (channel, code) in Channel::ALL.into_iter().zip(self.channels()) {
            let ChannelCode { shift_rad, projector, .. } = *code;
            if projector != channel.projector() {
                return fault(FourChannelFault::Projector { channel: channel.name() });
            }
            if shift_rad != if is_alone { 0.0 } else { channel.shift_rad() } {
                return fault(FourChannelFault::Shift { channel: channel.name(), found_rad: shift_rad });
            }
        }
        let [number, green, other] = [red, green, blue].map(|channel| channel.fringe_number);
        if is_alone && (green == number || green == other) {
            return fault(FourChannelFault::Alike(green));
        }
        if !is_alone && number != other {
            return fault(FourChannelFault::Quadrature { red: number, blue: other });
        }
        Ok(FourChannel {
            quadrature: number,
            green,
            infrared: infrared.first().map_or(0.0, |channel| channel.fringe_number),
            blue: if is_alone { other } else { 0.0 },
            projector_width: self.projector_width(),
            columns_px: self.columns_px(),
            ambiguity_margin_rad: self.ambiguity_margin_rad(),
        })
    }
}

#[cfg(test)]
impl FourChannel {
    /// The four-channel view of an encoding that is known to be valid.
    pub(crate) fn of(encoding: Result<Encoding>) -> Self {
        encoding.and_then(|encoding| encoding.four_channel_view()).expect("a valid four-channel encoding")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault_of(change: impl Fn(&mut [ChannelCode; 4])) -> FourChannelFault {
        let encoding = Encoding::optimum(36, 912).expect("valid");
        let mut channels: [ChannelCode; 4] = encoding.channels().try_into().expect("four");
        change(&mut channels);
        match Encoding::new(channels, 912).expect("all columns differ").four_channel_view() {
            Err(Error::NotFourChannel { fault }) => fault,
            other => panic!("expected a refusal, got {other:?}"),
        }
    }

    #[test]
    fn the_first_difference_is_named() {
        let found = fault_of(|channels| channels[3].projector = Projector::Visible);
        assert_eq!(found, FourChannelFault::Projector { channel: "IR" });
        let found = fault_of(|channels| channels[2].shift_rad = -FRAC_PI_2);
        assert_eq!(found, FourChannelFault::Shift { channel: "B", found_rad: -FRAC_PI_2 });
        let found = fault_of(|channels| channels[2].fringe_number = 37.0);
        assert_eq!(found, FourChannelFault::Quadrature { red: 36.0, blue: 37.0 });
        assert_eq!(found.to_string(), "36 fringes in R and 37 in B");
    }

    #[test]
    fn lists_of_two_and_of_five_channels_are_refused() {
        let encoding = Encoding::rgb([16.0, 15.0], 912).expect("valid");
        let count = |channels: Vec<ChannelCode>| match Encoding::new(channels, 912) {
            Ok(encoding) => encoding.four_channel_view(),
            Err(error) => Err(error),
        };
        let (all, two) = (encoding.channels(), &encoding.channels()[..2]);
        for (found, expected) in [(count(two.to_vec()), 2), (count([all, two].concat()), 5)] {
            assert!(
                matches!(found, Err(Error::NotFourChannel { fault: FourChannelFault::Count(n) }) if n == expected)
            );
        }
    }

    #[test]
    fn the_view_holds_the_numbers_of_the_list() {
        let encoding = Encoding::four_channel([36.0, 35.0, 30.0], 912).expect("valid");
        let four = encoding.four_channel_view().expect("the four channels");
        for (channel, code) in Channel::ALL.into_iter().zip(encoding.channels()) {
            assert_eq!(four.fringe_number(channel), code.fringe_number);
            assert_eq!(four.phase_rad(channel, 77.5), code.phase_rad(77.5, 912));
        }
        assert_eq!(four.period_px(), encoding.period_px());
    }

    #[test]
    fn three_colours_of_different_numbers_are_each_alone() {
        let encoding = Encoding::three_colours([36.0, 35.0, 30.0], 912).expect("valid");
        let view = encoding.four_channel_view().expect("three colours");
        assert_eq!((view.blue, view.has_infrared(), view.has_third()), (30.0, false, true));
        assert_eq!(view.fringe_number(Channel::B), 30.0);
        assert!(Channel::ALL.iter().all(|channel| view.shift_rad(*channel) == 0.0));
        assert_eq!(view.ratios(), [1.0, 35.0 / 36.0, 0.0, 30.0 / 36.0]);
        assert_eq!(FourChannel::of(Encoding::rgb([16.0, 15.0], 912)).ratios(), [1.0, 15.0 / 16.0, 1.0, 0.0]);
    }

    #[test]
    fn three_colours_of_which_two_are_alike_are_refused() {
        let fault_of =
            |numbers| match Encoding::three_colours(numbers, 912).and_then(|e| e.four_channel_view()) {
                Err(Error::NotFourChannel { fault }) => fault,
                other => panic!("expected a refusal, got {other:?}"),
            };
        for numbers in [[16.0, 16.0, 15.0], [16.0, 15.0, 15.0]] {
            assert_eq!(fault_of(numbers), FourChannelFault::Alike(numbers[1]));
        }
        let fault = FourChannelFault::Shift { channel: "B", found_rad: 0.0 };
        assert_eq!(fault_of([16.0, 15.0, 16.0]), fault);
    }
}
