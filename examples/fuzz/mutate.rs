//! Turns good files into odd ones.

use super::seeds::Seed;

/// SplitMix64 (Steele et al. 2014): the same numbers everywhere.
pub struct Random(u64);

impl Random {
    /// For one input.
    pub fn new(seed: u64, format: &str, index: u64) -> Random {
        let name = format.bytes().fold(0_u64, |hash, b| hash.wrapping_mul(31).wrapping_add(b.into()));
        let mut random = Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ name.rotate_left(32) ^ index);
        random.next();
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `n`, or 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn one<'a, T: ?Sized>(&mut self, of: &[&'a T]) -> &'a T {
        of[self.below(of.len())]
    }

    fn range(&mut self, length: usize, most: usize) -> std::ops::Range<usize> {
        let start = self.below(length);
        start..(start + 1 + self.below(most)).min(length)
    }
}

/// Where counts, sizes and types begin to hurt.
const INTEGERS: [i64; 22] = [
    0,
    1,
    2,
    3,
    -1,
    -2,
    127,
    128,
    255,
    256,
    32767,
    65535,
    65536,
    1 << 20,
    16_777_216,
    i32::MAX as i64,
    i32::MIN as i64,
    1 << 32,
    1 << 40,
    i64::MAX,
    i64::MIN,
    i64::MAX / 24,
];

const NUMBERS: [&str; 26] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "4",
    "65536",
    "1000000",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999",
    "1e5",
    "1e308",
    "1e-320",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "0,5",
    "1d5",
    "0x1p3",
    "1_000",
    "",
    "12345678901234567890123456789012345678901234567890",
];

const TOKENS: [&str; 44] = [
    "\n",
    "\r",
    "\r\n",
    "\t",
    "\"",
    "'",
    "#",
    ",",
    ";",
    " ",
    "\u{feff}",
    "\0",
    "\x1b[31m",
    "<",
    ">",
    "/>",
    "&#x41;",
    "&amp;",
    "]]>",
    "<!--",
    "element vertex 3\n",
    "property list uchar int x\n",
    "property double y\n",
    "end_header\n",
    "format binary_big_endian 1.0\n",
    "POINTS 3 float\n",
    "POINT_DATA 3\n",
    "SCALARS class int 1\nLOOKUP_TABLE default\n",
    "FIELD FieldData 2\n",
    "class 1 3 int\n",
    "METADATA\n",
    "CELLS 3 6\n",
    "OFFSETS vtktypeint64\n",
    "DATASET POLYDATA\n",
    "<Piece NumberOfPoints=\"3\">",
    "</Piece>",
    "<Points>",
    "NumberOfComponents=\"3\"",
    "offset=\"1\"",
    "'shape': (3, 3), ",
    "(((((",
    "[[[[[{{{{",
    "x,y,z\n",
    "class",
];

/// Input of a format.
pub fn one(random: &mut Random, seeds: &[Seed], format: &str) -> Vec<u8> {
    let seed = &seeds[random.below(seeds.len())];
    let mut bytes = seed.bytes.clone();
    // Now and then what surrounds the content is mutated too.
    let outside = random.below(4) == 0;
    for _ in 0..1 + random.below(2) * random.below(4) {
        mutate(random, &mut bytes, seeds);
    }
    if matches!(format, "npy" | "npz" | "mesh-npz") && random.below(8) != 0 {
        super::pack::mend_npy(&mut bytes);
    }
    let mut packed = seed.pack(&bytes);
    if outside {
        mutate(random, &mut packed, seeds);
    }
    if format == "png" && random.below(8) != 0 {
        super::pack::mend_png(&mut packed);
    }
    packed
}

fn mutate(random: &mut Random, bytes: &mut Vec<u8>, seeds: &[Seed]) {
    if bytes.is_empty() {
        bytes.push(random.next() as u8);
        return;
    }
    let at = random.below(bytes.len());
    match random.below(16) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(random.range(bytes.len(), 16))),
        4 => {
            let block = bytes[random.range(bytes.len(), 64)].to_vec();
            bytes.splice(at..at, block);
        }
        5 => {
            // A block over another, which keeps the length.
            let block = bytes[random.range(bytes.len(), 32)].to_vec();
            let end = (at + block.len()).min(bytes.len());
            let length = end - at;
            bytes[at..end].copy_from_slice(&block[..length]);
        }
        6 | 7 => integer(random, bytes, at),
        8 | 9 => number(random, bytes),
        10 => line(random, bytes),
        11 => {
            let other = &seeds[random.below(seeds.len())].bytes;
            bytes.truncate(at);
            bytes.extend(&other[random.below(other.len())..]);
        }
        12 => drop(bytes.splice(at..at, random.one(&TOKENS).bytes())),
        13 => {
            let end = (at + random.below(8)).min(bytes.len());
            bytes.splice(at..end, random.one(&TOKENS).bytes());
        }
        14 => {
            let value = if random.below(2) == 0 { 0 } else { 0xff };
            let range = random.range(bytes.len(), 12);
            bytes[range].fill(value);
        }
        _ => {
            // Many times the same: what is quadratic shows.
            let block = bytes[random.range(bytes.len(), 40)].to_vec();
            let times = 1 << random.below(9);
            bytes.splice(at..at, block.repeat(times));
        }
    }
}

/// An integer of 2, 4 or 8 bytes in either order.
fn integer(random: &mut Random, bytes: &mut [u8], at: usize) {
    let value = INTEGERS[random.below(INTEGERS.len())];
    let size = [1, 2, 4, 8][random.below(4)].min(bytes.len());
    let at = if random.below(2) == 0 { at - at % size } else { at }.min(bytes.len() - size);
    let (little, big) = (value.to_le_bytes(), value.to_be_bytes());
    let value = if random.below(2) == 0 { &little[..size] } else { &big[8 - size..] };
    bytes[at..at + size].copy_from_slice(value);
}

/// Another number for one that is written in digits.
fn number(random: &mut Random, bytes: &mut Vec<u8>) {
    let digit = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-');
    let from = random.below(bytes.len());
    let Some(start) = bytes[from..].iter().position(digit).map(|start| from + start) else {
        return;
    };
    let length = bytes[start..].iter().take_while(|b| digit(b)).count();
    bytes.splice(start..start + length, random.one(&NUMBERS).bytes());
}

/// A line taken out, repeated, or put elsewhere.
fn line(random: &mut Random, bytes: &mut Vec<u8>) {
    let lines: Vec<Vec<u8>> = bytes.split_inclusive(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    let (from, to) = (random.below(lines.len()), random.below(lines.len()));
    let mut lines = lines;
    match random.below(3) {
        0 => drop(lines.remove(from)),
        1 => {
            let line = lines[from].clone();
            lines.insert(to, line);
        }
        _ => lines.swap(from, to),
    }
    *bytes = lines.concat();
}
