//! Foreign text in messages: what a file or a name holds must not steer the terminal, nor flood it.

use std::path::Path;

/// Characters of a foreign text that are shown.
const SHOWN: usize = 60;
/// Names of a list that are shown.
const NAMES: usize = 8;

/// `text` on one line: what cannot be printed is escaped, and what follows 60 characters is cut with an ellipsis.
pub fn quote(text: &str) -> String {
    cut(text, SHOWN)
}

/// Names from a file, each [`quote`]d, with commas; after eight only how many more there are.
pub fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names = names.into_iter();
    let shown: Vec<String> = names.by_ref().take(NAMES).map(quote).collect();
    match names.count() {
        0 if shown.is_empty() => "none".into(),
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// A path, in full: the user wrote it. Control characters in it are escaped.
pub fn path(path: &Path) -> String {
    escape(&path.to_string_lossy()).collect()
}

/// The first `most` characters of `text`, escaped, and an ellipsis for the rest.
pub(crate) fn cut(text: &str, most: usize) -> String {
    let mut escaped = escape(text);
    let mut shown: String = escaped.by_ref().take(most).collect();
    if escaped.next().is_some() {
        shown.push('…');
    }
    shown
}

/// `text` in full, with what cannot be printed escaped; quotation marks and backslashes can be, and stay.
pub fn escape(text: &str) -> impl Iterator<Item = char> + '_ {
    text.chars().flat_map(|c| {
        let plain = matches!(c, '\'' | '"' | '\\').then_some(c);
        plain.into_iter().chain(plain.is_none().then(|| c.escape_debug()).into_iter().flatten())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_foreign_steers_the_terminal() {
        assert_eq!(quote("a\x1b[31mred\n\u{202e}\"'\\é"), "a\\u{1b}[31mred\\n\\u{202e}\"'\\é");
        assert_eq!(path(Path::new("a\rb.ply")), "a\\rb.ply");
        let long = quote(&"x".repeat(1000));
        assert!(long.chars().count() == 61 && long.ends_with('…'));
        let names: Vec<String> = (0..3000).map(|i| format!("p{i}")).collect();
        let list = list(names.iter().map(String::as_str));
        assert!(list.ends_with("p7 and 2992 more"), "{list}");
    }
}
