//! 24-bit images for the flash of the projector: patterns of any bit depth, packed plane by plane into BMP files.
//!
//! This crate does not write flash, because a failed write can only be repaired with the boot loader. Give the files to TI's
//! LightCrafter 4500 program, which builds a firmware image and uploads it; then
//! [`check_flash`](crate::LightCrafter::check_flash) checks whether the projector has it.

use crate::error::{Error, Result};
use crate::sequence::{HEIGHT_PX, WIDTH_PX, depth_limits, first_plane};

const PLANES: u8 = 24;
const HEADER_BYTES: usize = 54;
const PIXELS: usize = WIDTH_PX * HEIGHT_PX;

/// One pattern: 912 x 1140 values, row by row, each below 2 to the power of its bit depth.
#[derive(Debug, Clone, Copy)]
pub struct FlashPattern<'a> {
    /// The values.
    pub values: &'a [u8],
    /// Bits per pixel, 1 to 8.
    pub bit_depth: u8,
}

/// Place of a pattern in flash, as a [`LutEntry`](crate::command::LutEntry) needs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Placement {
    /// Number of the image.
    pub image: usize,
    /// Number of the pattern among those of its bit depth.
    pub number: u8,
    /// Bits per pixel.
    pub bit_depth: u8,
}

/// Pack patterns in order. Returns the BMP files and the place of each pattern.
///
/// A new image begins when the next pattern does not fit into the remaining planes. A pattern of the wrong size, a value
/// that needs more bits, and more than 256 images are errors.
pub fn pack(patterns: &[FlashPattern<'_>]) -> Result<(Vec<Vec<u8>>, Vec<Placement>)> {
    let placements = place(patterns)?;
    let count = placements.last().map_or(0, |placement| placement.image + 1);
    if count > 256 {
        return Err(Error::value("images for flash", "at most 256", count));
    }
    let mut images = vec![vec![0_u32; PIXELS]; count];
    for (pattern, placement) in patterns.iter().zip(&placements) {
        let shift = first_plane(placement.bit_depth, placement.number)?;
        for (pixel, value) in images[placement.image].iter_mut().zip(pattern.values) {
            *pixel |= u32::from(*value) << shift;
        }
    }
    Ok((images.iter().map(|planes| bmp(planes)).collect(), placements))
}

fn place(patterns: &[FlashPattern<'_>]) -> Result<Vec<Placement>> {
    let (mut image, mut next_plane) = (0, 0);
    let mut placements = Vec::with_capacity(patterns.len());
    for (i, pattern) in patterns.iter().enumerate() {
        check(i, pattern)?;
        let bit_depth = pattern.bit_depth;
        let number = match number_from(bit_depth, next_plane)? {
            Some(number) => number,
            None => {
                (image, next_plane) = (image + 1, 0);
                0
            }
        };
        next_plane = next_plane.max(first_plane(bit_depth, number)? + bit_depth);
        placements.push(Placement { image, number, bit_depth });
    }
    Ok(placements)
}

fn check(i: usize, pattern: &FlashPattern<'_>) -> Result<()> {
    depth_limits(pattern.bit_depth)?;
    if pattern.values.len() != PIXELS {
        let expected = format!("{PIXELS} values, {WIDTH_PX} x {HEIGHT_PX}");
        return Err(Error::value(format!("size of pattern {i}"), expected, pattern.values.len()));
    }
    let greatest = (1_u16 << pattern.bit_depth) - 1;
    match pattern.values.iter().find(|value| u16::from(**value) > greatest) {
        Some(value) => {
            let name = format!("a value of pattern {i} at {} bit", pattern.bit_depth);
            Err(Error::value(name, format!("0 to {greatest}"), value))
        }
        None => Ok(()),
    }
}

/// The first pattern number of this depth whose planes are all free.
fn number_from(bit_depth: u8, next_plane: u8) -> Result<Option<u8>> {
    let last = depth_limits(bit_depth)?.last_number.min(PLANES - 1);
    for number in 0..=last {
        if first_plane(bit_depth, number)? >= next_plane {
            return Ok(Some(number));
        }
    }
    Ok(None)
}

/// Planes G0 to G7, R0 to R7, B0 to B7 as a BMP: rows from the bottom, pixels as blue, green, red.
fn bmp(planes: &[u32]) -> Vec<u8> {
    let size = (HEADER_BYTES + 3 * PIXELS) as u32;
    let mut file = Vec::with_capacity(size as usize);
    file.extend(b"BM");
    file.extend([size, 0, HEADER_BYTES as u32, 40].map(u32::to_le_bytes).concat());
    file.extend([WIDTH_PX as u32, HEIGHT_PX as u32].map(u32::to_le_bytes).concat());
    file.extend([1_u16, 24].map(u16::to_le_bytes).concat());
    file.extend([0, 3 * PIXELS as u32, 2835, 2835, 0, 0].map(u32::to_le_bytes).concat());
    for row in planes.chunks(WIDTH_PX).rev() {
        for [green, red, blue, _] in row.iter().map(|pixel| pixel.to_le_bytes()) {
            file.extend([blue, green, red]);
        }
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blue, green, red of the pixel in the first row and column: the first pixel of the last row of the file.
    fn corner(bmp: &[u8]) -> [u8; 3] {
        let at = HEADER_BYTES + 3 * WIDTH_PX * (HEIGHT_PX - 1);
        [bmp[at], bmp[at + 1], bmp[at + 2]]
    }

    #[test]
    fn three_patterns_of_8_bit_are_green_red_and_blue() {
        let values = [0x11, 0x22, 0x33].map(|value| vec![value; PIXELS]);
        let patterns = values.each_ref().map(|values| FlashPattern { values, bit_depth: 8 });
        let (files, places) = pack(&patterns).unwrap();
        assert_eq!(files.len(), 1);
        assert_eq!(corner(&files[0]), [0x33, 0x11, 0x22]);
        assert_eq!(places.iter().map(|p| (p.image, p.number)).collect::<Vec<_>>(), [(0, 0), (0, 1), (0, 2)]);
        assert_eq!(files[0].len(), 54 + 3 * PIXELS);
        assert_eq!(&files[0][..2], b"BM");
        assert_eq!(u32::from_le_bytes(files[0][18..22].try_into().unwrap()), 912);
        assert_eq!(u32::from_le_bytes(files[0][22..26].try_into().unwrap()), 1140);
    }

    #[test]
    fn planes_of_one_bit_are_in_the_documented_order() {
        let (on, off) = (vec![1; PIXELS], vec![0; PIXELS]);
        for plane in 0..24_u32 {
            let values: Vec<&[u8]> = (0..24).map(|i| if i == plane { &on[..] } else { &off[..] }).collect();
            let patterns: Vec<_> =
                values.iter().map(|values| FlashPattern { values, bit_depth: 1 }).collect();
            let (files, _) = pack(&patterns).unwrap();
            let [blue, green, red] = corner(&files[0]).map(u32::from);
            assert_eq!(green | red << 8 | blue << 16, 1 << plane);
        }
    }

    #[test]
    fn a_new_image_begins_when_planes_run_out_and_depths_may_mix() {
        let zero = vec![0; PIXELS];
        let depths = [8, 7, 1, 5, 8, 6];
        let patterns = depths.map(|bit_depth| FlashPattern { values: &zero, bit_depth });
        let (files, places) = pack(&patterns).unwrap();
        let found: Vec<_> = places.iter().map(|p| (p.image, p.number)).collect();
        assert_eq!(found, [(0, 0), (0, 1), (0, 16), (0, 3), (1, 0), (1, 2)]);
        assert_eq!(files.len(), 2);
    }

    #[test]
    fn bad_patterns_are_refused() {
        let zero = vec![0; PIXELS];
        let refused =
            |values: &[u8], bit_depth| pack(&[FlashPattern { values, bit_depth }]).unwrap_err().to_string();
        assert!(refused(&zero[1..], 8).contains("912 x 1140"));
        assert!(refused(&zero, 9).contains("bit depth"));
        let mut wild = zero.clone();
        wild[77] = 4;
        assert!(refused(&wild, 2).contains("0 to 3, got 4"));
        let many = vec![FlashPattern { values: &zero[..], bit_depth: 8 }; 769];
        assert!(place(&many).unwrap().last().unwrap().image == 256);
    }
}
