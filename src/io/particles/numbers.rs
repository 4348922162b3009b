//! Packed numbers, as VTK, PLY and raw files store them.

use exr::prelude::f16;

/// A number's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    F16,
    F32,
    F64,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
}

impl Kind {
    /// By the names of VTK's XML files, legacy VTK and PLY, which do not contradict each other but for `long`: see there.
    pub(super) fn named(name: &str) -> Option<Kind> {
        Some(match name {
            "Float32" | "float" | "float32" => Kind::F32,
            "Float64" | "double" | "float64" => Kind::F64,
            "Int8" | "char" | "int8" | "signed_char" => Kind::I8,
            "UInt8" | "uchar" | "uint8" | "unsigned_char" => Kind::U8,
            "Int16" | "short" | "int16" => Kind::I16,
            "UInt16" | "ushort" | "uint16" | "unsigned_short" => Kind::U16,
            "Int32" | "int" | "int32" => Kind::I32,
            "UInt32" | "uint" | "uint32" | "unsigned_int" => Kind::U32,
            "Int64" | "vtktypeint64" | "vtkidtype_64" => Kind::I64,
            "UInt64" | "vtktypeuint64" => Kind::U64,
            _ => return None,
        })
    }

    /// What `meniscus info` calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Kind::F16 => "float16",
            Kind::F32 => "float32",
            Kind::F64 => "float64",
            Kind::I8 => "int8",
            Kind::U8 => "uint8",
            Kind::I16 => "int16",
            Kind::U16 => "uint16",
            Kind::I32 => "int32",
            Kind::U32 => "uint32",
            Kind::I64 => "int64",
            Kind::U64 => "uint64",
        }
    }

    /// Bytes of one number.
    pub(super) fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::F16 | Kind::I16 | Kind::U16 => 2,
            Kind::F32 | Kind::I32 | Kind::U32 => 4,
            Kind::F64 | Kind::I64 | Kind::U64 => 8,
        }
    }

    /// The number that `bytes` are, which are [`Kind::size`] many.
    pub(super) fn decode(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut le = [0; 8];
        for (i, slot) in le[..self.size()].iter_mut().enumerate() {
            *slot = bytes[if big_endian { self.size() - 1 - i } else { i }];
        }
        let bits = u64::from_le_bytes(le);
        match self {
            Kind::F16 => f16::from_bits(bits as u16).into(),
            Kind::F32 => f32::from_bits(bits as u32).into(),
            Kind::F64 => f64::from_bits(bits),
            Kind::I8 => (bits as i8).into(),
            Kind::I16 => (bits as i16).into(),
            Kind::I32 => (bits as i32).into(),
            Kind::I64 => bits as i64 as f64,
            Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => bits as f64,
        }
    }
}

/// Decodes numbers of which the bytes come in parts: a number may begin in one and end in the next.
pub(super) struct Decoder {
    kind: Kind,
    big_endian: bool,
    open: [u8; 8],
    filled: usize,
}

impl Decoder {
    pub(super) fn new(kind: Kind, big_endian: bool) -> Decoder {
        Decoder { kind, big_endian, open: [0; 8], filled: 0 }
    }

    pub(super) fn feed(&mut self, mut bytes: &[u8], mut each: impl FnMut(f64)) {
        let size = self.kind.size();
        while self.filled > 0 {
            let Some((first, rest)) = bytes.split_first() else {
                return;
            };
            (self.open[self.filled], bytes) = (*first, rest);
            self.filled += 1;
            if self.filled == size {
                each(self.kind.decode(&self.open, self.big_endian));
                self.filled = 0;
            }
        }
        let whole = bytes.chunks_exact(size);
        let rest = whole.remainder();
        self.open[..rest.len()].copy_from_slice(rest);
        self.filled = rest.len();
        whole.for_each(|number| each(self.kind.decode(number, self.big_endian)));
    }

    /// Bytes of a number that did not end.
    pub(super) fn left(&self) -> usize {
        self.filled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_may_be_cut_anywhere() {
        let bytes: Vec<u8> = [1.5_f32, -2.0, 1e9].iter().flat_map(|v| v.to_be_bytes()).collect();
        for cut in 0..=bytes.len() {
            let (mut decoder, mut values) = (Decoder::new(Kind::F32, true), Vec::new());
            decoder.feed(&bytes[..cut], |v| values.push(v));
            decoder.feed(&bytes[cut..], |v| values.push(v));
            assert_eq!((values.as_slice(), decoder.left()), (&[1.5, -2.0, 1e9][..], 0), "{cut}");
        }
        assert_eq!(Kind::F16.decode(&[0xc1, 0x00], true), -2.5);
        assert_eq!(Kind::I16.decode(&[0xff, 0xfe], true), -2.0);
        assert_eq!(Kind::U64.decode(&[0, 0, 0, 0, 0, 0, 0, 1], true), 1.0);
    }
}
