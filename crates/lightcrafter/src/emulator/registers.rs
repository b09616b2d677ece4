//! The plain registers: length, reset value and accepted values, as in the programmer's guide.

use std::collections::BTreeMap;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    ReadOnly,
    WriteOnly,
    Both,
}

use Kind::{Both, ReadOnly, WriteOnly};

/// Word, direction, value after power-on (as long as the register), and the greatest value of each byte.
type Row = (u16, Kind, &'static [u8], &'static [u8]);

const ANY: &[u8] = &[];

/// The commands of the guide that are plain registers.
const ROWS: &[Row] = &[
    (0x1A0A, ReadOnly, &[1], ANY),
    (0x1A0B, ReadOnly, &[1], ANY),
    (0x0205, ReadOnly, &[0, 0, 4, 4, 0, 0, 4, 4, 0, 0, 4, 4, 0, 0, 4, 4], ANY),
    (0x0200, Both, &[0], &[1]),
    (0x0609, WriteOnly, &[0], &[1]),
    (0x100A, Both, &[0], &[1]),
    (0x1A1B, Both, &[0], &[1]),
    (0x1A00, Both, &[0x08], &[0x2B]),
    (0x1A02, Both, &[0], &[2]),
    (0x1A03, Both, &[0], &[2]),
    (0x1A37, Both, &[4], &[0x85]),
    (0x1A04, Both, &[0], &[0xCF]),
    (0x1000, Both, &[0, 0, 0, 0, 0x90, 3, 0x74, 4, 0, 0, 0, 0, 0x90, 3, 0x74, 4], ANY),
    (0x1203, Both, &[8], &[10]),
    (
        0x1204,
        Both,
        &[0xFF, 3, 0xFF, 3, 0xFF, 3, 0, 0, 0, 0, 0, 0],
        &[255, 3, 255, 3, 255, 3, 255, 3, 255, 3, 255, 3],
    ),
    (0x1A39, Both, &[0], ANY),
    (0x1008, Both, &[0], &[1]),
    (0x1009, Both, &[0], &[1]),
    (0x1A0E, Both, &[0x80], &[0x81]),
    (0x1100, Both, &[0; 6], &[255, 3, 255, 3, 255, 3]),
    (0x1A07, Both, &[8], &[15]),
    (0x0B01, Both, &[0x97, 0x78, 0x7D], ANY),
    (0x1A05, Both, &[0], &[1]),
    (0x1A1F, Both, &[0xBB, 0xBB], ANY),
    (0x1A20, Both, &[0xBB, 0xBB], ANY),
    (0x1A21, Both, &[0xBB, 0xBB], ANY),
    (0x1A22, Both, &[3], &[3]),
    (0x1A23, Both, &[1], &[4]),
    (0x1A29, Both, &[0x20, 0xA1, 7, 0, 0x20, 0xA1, 7, 0], ANY),
    (0x1A31, Both, &[0, 0, 0, 0], &[127, 1, 255, 63]),
    (0x1A33, WriteOnly, &[0], &[3]),
    (0x1A32, WriteOnly, &[0], &[127]),
    (0x1A3F, WriteOnly, &[0, 0], &[255, 7]),
    (0x1A40, Both, &[0; 6], &[255, 7, 255, 7, 255, 1]),
    (0x1A30, Both, &[0], &[1]),
    (0x1A24, Both, &[0], &[2]),
    (0x1A1D, Both, &[0, 0xBB, 0xBB], &[3, 0xD5, 0xD5]),
    (0x1A1E, Both, &[0, 0xBB], &[3, 255]),
    (0x1A35, Both, &[0; 4], &[255, 255, 7, 0]),
    (0x1A36, Both, &[0], &[1]),
];

/// Registers that must not change while patterns run.
pub fn needs_stop(word: u16) -> bool {
    matches!(
        word,
        0x1A22
            | 0x1A23
            | 0x1A29
            | 0x1A31
            | 0x1A33
            | 0x1A32
            | 0x1A34
            | 0x1A3E
            | 0x1A3F
            | 0x1A40
            | 0x1A1A
            | 0x1A1B
    )
}

/// A value, and the number of reads that still return the previous one.
#[derive(Debug, Clone)]
struct Cell {
    kind: Kind,
    value: Vec<u8>,
    before: Vec<u8>,
    lag: u32,
    greatest: &'static [u8],
}

#[derive(Debug, Clone)]
pub struct Registers {
    cells: BTreeMap<u16, Cell>,
    tag: Vec<u8>,
    images: u8,
    load_images: u8,
}

impl Registers {
    pub fn new(tag: &str, images: u8) -> Self {
        let cell = |kind, value: &[u8], greatest| Cell {
            kind,
            value: value.to_vec(),
            before: Vec::new(),
            lag: 0,
            greatest,
        };
        let cells = ROWS.iter().map(|(word, kind, value, greatest)| (*word, cell(*kind, value, *greatest)));
        let mut tag: Vec<u8> = tag.bytes().take(32).collect();
        tag.resize(32, 0);
        Self { cells: cells.collect(), tag, images, load_images: 0 }
    }

    pub fn tag(&self) -> String {
        self.tag.iter().take_while(|byte| **byte != 0).copied().map(char::from).collect()
    }

    pub fn image_count(&self) -> u8 {
        self.images
    }

    /// The first byte of a register without the lag of reads.
    pub fn byte(&self, word: u16) -> u8 {
        self.bytes(word).first().copied().unwrap_or(0)
    }

    pub fn bytes(&self, word: u16) -> &[u8] {
        self.cells.get(&word).map_or(&[], |cell| &cell.value)
    }

    pub fn force(&mut self, word: u16, data: &[u8]) {
        if let Some(cell) = self.cells.get_mut(&word) {
            cell.value = data.to_vec();
            cell.lag = 0;
        }
    }

    pub fn read(&mut self, word: u16) -> Option<Vec<u8>> {
        match word {
            0x1AFF => return Some(self.tag.clone()),
            0x1A42 => return Some(vec![self.images]),
            // 50 ms for each image.
            0x1A3A => return Some((u32::from(self.load_images) * 933_350).to_le_bytes().to_vec()),
            _ => {}
        }
        let cell = self.cells.get_mut(&word).filter(|cell| cell.kind != WriteOnly)?;
        if cell.lag > 0 {
            cell.lag -= 1;
            return Some(cell.before.clone());
        }
        Some(cell.value.clone())
    }

    pub fn write(&mut self, word: u16, data: &[u8]) -> Option<()> {
        self.write_late(word, data, 0)
    }

    /// Write a value. The next `lag` reads still return the previous one.
    pub fn write_late(&mut self, word: u16, data: &[u8], lag: u32) -> Option<()> {
        if word == 0x1A3A && data.len() == 2 {
            self.load_images = data[1];
            return Some(());
        }
        let cell = self.cells.get_mut(&word).filter(|cell| cell.kind != ReadOnly)?;
        let in_range = cell.greatest.iter().zip(data).all(|(greatest, byte)| byte <= greatest);
        if data.len() != cell.value.len() || !in_range {
            return None;
        }
        cell.before = std::mem::replace(&mut cell.value, data.to_vec());
        cell.lag = if cell.before == cell.value { 0 } else { lag };
        Some(())
    }
}

/// Reply about the video signal. In pattern mode it reports no stable signal.
pub fn video_signal(connected: bool, video_mode: bool) -> Vec<u8> {
    let mut data = vec![0; 28];
    if !connected {
        return data;
    }
    data[0] = if video_mode { 2 } else { 1 };
    let words = [(1, 912), (3, 1140), (12, 7020), (14, 6000), (16, 1040), (18, 1170), (20, 912), (22, 1140)];
    for (at, word) in words {
        data[at..at + 2].copy_from_slice(&u16::to_le_bytes(word));
    }
    data[8..12].copy_from_slice(&73_008_u32.to_le_bytes());
    data
}
