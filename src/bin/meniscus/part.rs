//! A part of a work that several programs make at once, each with a number of its own.

use crate::terminal;
use std::{ops::Range, str::FromStr};

/// The K-th of N parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    index: usize,
    of: usize,
}

impl Part {
    /// Which of so many things it has, one after the other: all parts have all of them, none twice, as many as the others or one more.
    pub fn range(self, count: usize) -> Range<usize> {
        let begin = |part: usize| (count as u128 * part as u128 / self.of as u128) as usize;
        begin(self.index)..begin(self.index + 1)
    }

    /// As a part of a file's name.
    pub fn name(self) -> String {
        format!("part-{}-of-{}", self.index, self.of)
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Part, String> {
        let part = text.split_once('/').and_then(|(k, n)| Some(Part { index: k.parse().ok()?, of: n.parse().ok()? }));
        part.filter(|p| p.index < p.of).ok_or_else(|| {
            let text = terminal::plain(text);
            format!("\"{text}\" is no part: use K/N with K from 0 to N - 1, such as 0/10 to 9/10")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_everything_once() {
        for (count, of) in [(0, 1), (1, 3), (7, 3), (10, 10), (1000, 7), (usize::MAX, 3)] {
            let mut next = 0;
            for index in 0..of {
                let range = Part { index, of }.range(count);
                assert_eq!(range.start, next);
                assert!((count / of..=count / of + 1).contains(&range.len()));
                next = range.end;
            }
            assert_eq!(next, count);
        }
    }

    #[test]
    fn what_is_no_part_is_refused() {
        assert_eq!("3/10".parse(), Ok(Part { index: 3, of: 10 }));
        for text in ["", "3", "10/10", "-1/3", "1/0", "a/b", "1/2/3"] {
            assert!(text.parse::<Part>().unwrap_err().contains("use K/N"), "{text}");
        }
    }
}
