//! The methods that decode a shot, each with the options that only it has.

use super::params::DETAIL;
use crate::encoding::Encoding;
use crate::error::{Error, Limit, Result};
use crate::height::PairTable;
use std::fmt::{self, Formatter};
use std::sync::Arc;

/// Names of the methods.
const NAMES: &[&str] = &["published", "joint"];

/// The method that decodes a shot. Options that only one method has are part of that method.
///
/// ```
/// use quadfringe::{Decoder, Encoding, Method, Options};
/// let encoding = Encoding::optimum(36, 912)?;
/// let published = Options::default().with_method(Method::published());
/// let decoder = Decoder::builder(&encoding, [768, 1024]).options(published).build()?;
/// assert_eq!(decoder.options().method.name(), "published");
/// assert_eq!(Method::default().name(), "joint");
/// # Ok::<(), quadfringe::Error>(())
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Method {
    /// Fits all four channels together: a local fit in any fringe direction, a phase weighted by noise, and fringe
    /// orders from neighbourhoods. It is the default, because it has the most accurate phase and the fewest wrong
    /// orders.
    Joint(JointOptions),
    /// The chain of the paper: mean envelope, two-step phase shifting, improved Fourier filter along the rows, ladder of
    /// beats pixel by pixel. Needs fringes that run across the rows.
    Published(PublishedOptions),
}

impl Method {
    /// The joint method with its defaults.
    #[must_use]
    pub fn joint() -> Self {
        Self::Joint(JointOptions::default())
    }

    /// The published method with its defaults.
    #[must_use]
    pub fn published() -> Self {
        Self::Published(PublishedOptions::default())
    }

    /// The method of this name with its defaults: joint or published. `best`, the earlier name of `joint`, is read from
    /// old settings and files.
    ///
    /// # Errors
    /// [`Error::Value`] for any other name; it lists the valid names.
    pub fn from_name(name: &str) -> Result<Self> {
        match name {
            "joint" | "best" => Ok(Self::joint()),
            "published" => Ok(Self::published()),
            _ => Err(Error::value("method", Limit::OneOf(NAMES), format!("{name:?}"))),
        }
    }

    /// This method for a calibrated pair, with the camera rays of `table`; for callers that chose the method by name.
    #[must_use]
    pub fn with_along_rays(self, table: PairTable) -> Self {
        match self {
            Self::Published(published) => published.with_along_rays(table).into(),
            Self::Joint(joint) => joint.with_along_rays(table).into(),
        }
    }

    /// This method with channels that are exposed at these instants (R, G, B, IR); for callers that chose the method by
    /// name.
    ///
    /// # Errors
    /// [`Error::NotOfMethod`] for any method but the joint one.
    pub fn with_channel_instants_us(self, instants: [f32; 4]) -> Result<Self> {
        match self {
            Self::Joint(joint) => Ok(joint.with_channel_instants_us(instants).into()),
            Self::Published(_) => Err(self.lacks("channel_instants_us", "joint")),
        }
    }

    /// This method with this choice between detail and noise; for callers that chose the method by name.
    ///
    /// # Errors
    /// [`Error::NotOfMethod`] for any method but the joint one.
    pub fn with_detail(self, detail: f32) -> Result<Self> {
        match self {
            Self::Joint(joint) => Ok(joint.with_detail(detail).into()),
            Self::Published(_) => Err(self.lacks("detail", "joint")),
        }
    }

    /// Checks the options of the method for images of `shape` (rows, columns).
    pub(super) fn check(&self, shape: [usize; 2]) -> Result<()> {
        match self {
            Self::Joint(joint) => joint.check(shape),
            Self::Published(published) => published.check(shape),
        }
    }

    const fn lacks(&self, option: &'static str, of: &'static str) -> Error {
        Error::NotOfMethod { option, of, method: self.name() }
    }

    /// Name of the method in settings and files.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Joint(_) => "joint",
            Self::Published(_) => "published",
        }
    }

    /// Version of the method, for saved results. It changes whenever the method gives different maps for the same shot
    /// and options.
    #[must_use]
    pub const fn version(&self) -> &'static str {
        match self {
            Self::Joint(_) | Self::Published(_) => "1",
        }
    }

    /// Checks that the method decodes this encoding. Both methods take the four channels of the paper, with any fringe
    /// numbers.
    ///
    /// # Errors
    /// [`Error::NotFourChannel`], which names the first difference.
    pub fn accepts(&self, encoding: &Encoding) -> Result<()> {
        match self {
            Self::Joint(_) | Self::Published(_) => encoding.four_channel_view().map(|_| ()),
        }
    }
}

impl Default for Method {
    fn default() -> Self {
        Self::joint()
    }
}

impl From<JointOptions> for Method {
    fn from(options: JointOptions) -> Self {
        Self::Joint(options)
    }
}

impl From<PublishedOptions> for Method {
    fn from(options: PublishedOptions) -> Self {
        Self::Published(options)
    }
}

/// Options of the joint method.
#[derive(Clone)]
#[non_exhaustive]
pub struct JointOptions {
    /// The middle of the exposure of R, G, B and IR in us, relative to the instant for which the shape is computed;
    /// `None` if all channels are exposed together. Set it if the surface moves and the projector shows its colours one
    /// after another.
    pub channel_instants_us: Option<[f32; 4]>,
    /// The infrared phase along the camera rays, if both projectors are calibrated. With `None` the two projectors are assumed
    /// to be coaxial.
    pub along_rays: Option<Arc<PairTable>>,
    /// Detail against noise, from 0.25 to 4. The shot itself says how finely its surface varies; relief narrower by this factor is
    /// kept, with more noise, or with a factor below 1 less of both. Default: 1.
    pub detail: f32,
}

impl Default for JointOptions {
    fn default() -> Self {
        Self { channel_instants_us: None, along_rays: None, detail: 1.0 }
    }
}

impl JointOptions {
    /// Options for channels that are exposed at these instants: R, G, B, IR.
    #[must_use]
    pub const fn with_channel_instants_us(mut self, instants: [f32; 4]) -> Self {
        self.channel_instants_us = Some(instants);
        self
    }

    /// These options for a calibrated pair, whose infrared phase is that of `table`.
    #[must_use]
    pub fn with_along_rays(mut self, table: PairTable) -> Self {
        self.along_rays = Some(Arc::new(table));
        self
    }

    /// These options with this choice between detail and noise.
    #[must_use]
    pub const fn with_detail(mut self, detail: f32) -> Self {
        self.detail = detail;
        self
    }

    fn check(&self, shape: [usize; 2]) -> Result<()> {
        check_camera(self.along_rays.as_deref(), shape)?;
        if !DETAIL.contains(&self.detail) {
            let [from, to] = [*DETAIL.start(), *DETAIL.end()].map(f64::from);
            return Err(Error::value("detail", Limit::Range { from, to }, self.detail));
        }
        let Some(instants) = self.channel_instants_us else { return Ok(()) };
        let expected = match instants {
            _ if instants.iter().any(|t| !t.is_finite()) => Limit::Finite,
            _ if instants.iter().all(|t| *t == instants[0]) => Limit::words("times that differ, or none"),
            _ => return Ok(()),
        };
        Err(Error::value("channel_instants_us", expected, instants))
    }
}

/// Options of the published method.
#[derive(Clone, Default)]
#[non_exhaustive]
pub struct PublishedOptions {
    /// Table for the search of fringe orders along the camera rays, if both projectors are calibrated: each candidate
    /// order is a depth, at which the infrared projector lights the ray with a known phase. With `None` the two
    /// projectors are assumed to be coaxial.
    pub along_rays: Option<Arc<PairTable>>,
}

impl PublishedOptions {
    /// Options for a search of fringe orders along the camera rays of `table`.
    #[must_use]
    pub fn with_along_rays(mut self, table: PairTable) -> Self {
        self.along_rays = Some(Arc::new(table));
        self
    }

    fn check(&self, shape: [usize; 2]) -> Result<()> {
        check_camera(self.along_rays.as_deref(), shape)
    }
}

/// Checks that a table is for images of `shape` (rows, columns).
fn check_camera(table: Option<&PairTable>, shape: [usize; 2]) -> Result<()> {
    match table {
        Some(table) if <[usize; 2]>::from(table.shape()) != shape => {
            let (rows, columns) = table.shape();
            Err(Error::shape("camera of the calibrated pair", &shape, &[rows, columns]))
        }
        _ => Ok(()),
    }
}

/// Leaves out the numbers of the table.
impl fmt::Debug for JointOptions {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let size = self.along_rays.as_ref().map(|table| table.shape());
        let mut fields = f.debug_struct("JointOptions");
        fields.field("channel_instants_us", &self.channel_instants_us).field("along_rays", &size);
        fields.field("detail", &self.detail).finish()
    }
}

/// Leaves out the numbers of the table.
impl fmt::Debug for PublishedOptions {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let size = self.along_rays.as_ref().map(|table| table.shape());
        f.debug_struct("PublishedOptions").field("along_rays", &size).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_methods_are_read_back() {
        for method in [Method::joint(), Method::published()] {
            let read = Method::from_name(method.name()).expect("a name that the method gives");
            assert_eq!((read.name(), read.version()), (method.name(), method.version()));
        }
    }

    /// Settings and files of earlier versions contain this name.
    #[test]
    fn best_is_read_as_joint() {
        assert_eq!(Method::from_name("best").expect("the earlier name").name(), "joint");
        for other in ["Best", "fast", ""] {
            let refused = Method::from_name(other).map(|_| ()).unwrap_err();
            assert_eq!(refused.to_string(), format!("method: expected published or joint, got {other:?}"));
        }
    }
}
