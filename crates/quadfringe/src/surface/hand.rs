//! A moving hand, composed of capsules.

use std::f64::consts::TAU;

use multiversion::multiversion;

use super::blend::{Blend, Capsule, Lanes};
use super::cells::Cells;
use super::{RangedRay, Surface, around, march, normal_of};
use crate::error::{Error, Limit, Result};
use crate::optics::Ray;

/// A hand in front of the reference plane at one instant. It waves about the wrist with a period of 2 s, its fingers close
/// and open with a period of 3 s, and it approaches and recedes with a period of 4 s.
///
/// ```
/// use quadfringe::surface::{Hand, Surface};
/// let palm = [0.0, 30.0, 750.0];
/// assert!(Hand::at(0.0)?.value(palm) < 0.0);
/// # Ok::<(), quadfringe::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Hand {
    capsules: Vec<Capsule>,
    cells: Cells,
}

const WRIST_MM: [f64; 3] = [0.0, 82.0, 752.0];
/// Length over which the seams between capsules are rounded off, mm.
const ROUNDING_MM: f64 = 7.0;
/// A finger of the resting hand.
struct Finger {
    /// Position (x, y) of the knuckle relative to the wrist, mm.
    knuckle_mm: [f64; 2],
    /// Length of the first joint, mm.
    length_mm: f64,
    /// Sideways angle, rad.
    spread_rad: f64,
    radius_mm: f64,
}

const fn finger(knuckle_mm: [f64; 2], length_mm: f64, spread_rad: f64, radius_mm: f64) -> Finger {
    Finger { knuckle_mm, length_mm, spread_rad, radius_mm }
}

/// Index finger to little finger.
const FINGERS: [Finger; 4] = [
    finger([-31.0, -78.0], 36.0, -0.16, 9.5),
    finger([-10.0, -84.0], 40.0, -0.04, 10.0),
    finger([11.0, -80.0], 37.0, 0.07, 9.5),
    finger([30.0, -70.0], 29.0, 0.20, 8.0),
];
/// Length of each joint of a finger divided by the length of the first joint.
const JOINTS: [f64; 3] = [1.0, 0.68, 0.5];

impl Hand {
    /// The hand at an instant in seconds.
    ///
    /// # Errors
    /// [`Error::Value`] when the time is not finite.
    pub fn at(time_s: f64) -> Result<Self> {
        if !time_s.is_finite() {
            return Err(Error::value("time_s", Limit::Finite, time_s));
        }
        let wave = 0.22 * (TAU * time_s / 2.0).sin();
        let curl = 0.30 - 0.22 * (TAU * time_s / 3.0).cos();
        let nearer = 12.0 * (TAU * time_s / 4.0).sin();
        let mut capsules = Vec::new();
        let mut add = |start: [f64; 3], end: [f64; 3], radius: f64| {
            capsules.push(Capsule::new(placed(start, wave, nearer), placed(end, wave, nearer), radius));
        };
        for Finger { knuckle_mm: [x, y], length_mm: length, spread_rad: spread, radius_mm: radius } in FINGERS
        {
            add([0.45 * x, -6.0, 0.0], [x, y, 0.0], radius + 3.5);
            let mut joint = [x, y, 0.0];
            for (index, share) in JOINTS.into_iter().enumerate() {
                let bend = curl * (index as f64 + 0.6);
                let end = step(joint, length * share, spread, bend);
                add(joint, end, radius - 0.8 * index as f64);
                joint = end;
            }
        }
        let thumb = step([-34.0, -34.0, -4.0], 30.0, -0.75, 0.5 * curl);
        add([-10.0, -8.0, 0.0], [-34.0, -34.0, -4.0], 13.0);
        add([-34.0, -34.0, -4.0], thumb, 10.5);
        add(thumb, step(thumb, 24.0, -0.5, curl), 9.5);
        Ok(Self::from_capsules(capsules))
    }

    fn from_capsules(capsules: Vec<Capsule>) -> Self {
        // Blending makes the body larger than its capsules, by less than the rounding.
        let extreme = |axis: usize, end: usize, pick: fn(f64, f64) -> f64| {
            let ends = capsules.iter().map(|capsule| capsule.extent(axis)[end]);
            ends.reduce(pick).unwrap_or(0.0)
        };
        let bounds_mm = [
            std::array::from_fn(|axis| extreme(axis, 0, f64::min) - ROUNDING_MM),
            std::array::from_fn(|axis| extreme(axis, 1, f64::max) + ROUNDING_MM),
        ];
        let blends = vec![Blend::Add(ROUNDING_MM); capsules.len()];
        let cells = Cells::new(bounds_mm, &blends, |part, p_mm| capsules[part].value(p_mm));
        Self { capsules, cells }
    }
}

/// Takes a point of the resting hand, given relative to the wrist, turns it by the wave, moves it nearer, and expresses
/// it in the camera frame.
fn placed([x, y, z]: [f64; 3], wave_rad: f64, nearer_mm: f64) -> [f64; 3] {
    let (s, c) = wave_rad.sin_cos();
    let [wx, wy, wz] = WRIST_MM;
    [wx + c * x - s * y, wy + s * x + c * y, wz + z - nearer_mm]
}

/// End of a joint that leans sideways by `spread` and towards the camera by `bend`.
fn step([x, y, z]: [f64; 3], length_mm: f64, spread_rad: f64, bend_rad: f64) -> [f64; 3] {
    let flat = length_mm * bend_rad.cos();
    [x + flat * spread_rad.sin(), y - flat * spread_rad.cos(), z - length_mm * bend_rad.sin()]
}

impl Surface for Hand {
    fn value(&self, p_mm: [f64; 3]) -> f64 {
        self.cells.blended(p_mm, |part| self.capsules[part].value(p_mm))
    }

    fn bounds_mm(&self) -> [[f64; 3]; 2] {
        self.cells.bounds_mm()
    }

    fn value_floor(&self, p_mm: [f64; 3]) -> f64 {
        // The bounds are wider than the capsules by more than blending lowers the value.
        self.cells.floor_mm(p_mm).unwrap_or_else(|| self.cells.outside_mm(p_mm))
    }

    fn hit(&self, ray: &Ray, range_mm: [f64; 2]) -> Option<f64> {
        if self.cells.is_passed_by(ray, range_mm) {
            return None;
        }
        march::first_crossing(self, ray, range_mm)
    }

    fn hit_all(&self, rays: &[RangedRay]) -> Vec<Option<f64>> {
        let mut found = vec![None; rays.len()];
        let is_wanted = |index: &usize| !self.cells.is_passed_by(&rays[*index].ray, rays[*index].range_mm);
        let wanted = (0..rays.len()).filter(is_wanted);
        march::first_crossings(self, |points| values(self, points), rays, wanted, &mut found);
        found
    }

    fn normal(&self, p_mm: [f64; 3]) -> [f64; 3] {
        normal_of(values(self, &around(p_mm)))
    }
}

/// Values at several points, by coordinate.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl", "x86_64+avx2"))]
fn values(hand: &Hand, p_mm: &[Lanes; 3]) -> Lanes {
    hand.cells.blended_all(hand.cells.parts_at_all(p_mm), |part| hand.capsules[part].values(p_mm))
}
