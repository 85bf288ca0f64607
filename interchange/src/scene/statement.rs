//! Statements of OBJ and MTL text (Wavefront "Object Files", version 3.0): decoding, continuation lines, comments.

use crate::counted::counted;
use crate::error::{Error, Result};
use std::borrow::Cow;
use std::path::Path;

/// Keywords followed by a name or file name: there `#` is a letter (`usemtl Material #25` is a habit of exporters).
const NAME_KEYWORDS: [&str; 5] = ["g", "o", "usemtl", "mtllib", "newmtl"];

/// How many different unknown keywords are told one by one.
const UNKNOWN_TOLD: usize = 8;

/// Longest part of the user's text that a message repeats, in letters.
const SHOWN_LETTERS: usize = 60;

/// One statement: a line, or several joined by `\`.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Statement<'t> {
    /// Line it begins on, from 1.
    pub line: usize,
    /// First word.
    pub keyword: &'t str,
    /// What follows the keyword, trimmed; continuation lines joined by one space.
    pub rest: Cow<'t, str>,
}

/// The text of a file, without byte order mark; text that is not UTF-8 is refused with its line.
pub(super) fn decode<'b>(path: &Path, bytes: &'b [u8]) -> Result<&'b str> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(Error::scene(path, 1, "the file is UTF-16, expected UTF-8; save it as UTF-8"));
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let (before, after) = bytes.split_at(e.valid_up_to());
        let byte = after.first().copied().unwrap_or_default();
        let message = format!("byte 0x{byte:02x} is not UTF-8; save the file as UTF-8");
        Error::scene(path, 1 + count_line_ends(before), message)
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// Number of line ends: LF, CR LF, or CR alone.
fn count_line_ends(bytes: &[u8]) -> usize {
    let followed_by = |i: usize| bytes.get(i + 1).copied();
    let ends = |(i, &byte): (usize, &u8)| byte == b'\n' || byte == b'\r' && followed_by(i) != Some(b'\n');
    bytes.iter().enumerate().filter(|&at| ends(at)).count()
}

/// The statements of `text` in order; empty lines and comments are passed over.
pub(super) fn statements(text: &str) -> Statements<'_> {
    Statements { lines: Lines { rest: text, line: 0 } }
}

/// See [`statements`].
#[derive(Debug)]
pub(super) struct Statements<'t> {
    lines: Lines<'t>,
}

impl<'t> Iterator for Statements<'t> {
    type Item = Statement<'t>;

    fn next(&mut self) -> Option<Statement<'t>> {
        loop {
            let text = self.lines.next()?.trim();
            let line = self.lines.line;
            // A comment ends with its line, even if a path in it ends in a backslash.
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
            // `f\` at the end of a line is `f` and a continuation.
            let (keyword, rest) = match keyword.strip_suffix('\\') {
                Some(word) if rest.is_empty() && !word.is_empty() => (word, "\\"),
                _ => (keyword, rest),
            };
            return Some(Statement { line, keyword, rest: self.joined(keyword, rest) });
        }
    }
}

impl<'t> Statements<'t> {
    /// `rest` with the lines that continue it.
    fn joined(&mut self, keyword: &str, rest: &'t str) -> Cow<'t, str> {
        let is_name = NAME_KEYWORDS.contains(&keyword);
        let clean = |part: &'t str| if is_name { part.trim() } else { without_comment(part).trim() };
        let rest = clean(rest);
        let Some(first) = rest.strip_suffix('\\') else { return Cow::Borrowed(rest) };
        let mut joined = first.trim_end().to_owned();
        for next in self.lines.by_ref() {
            let part = clean(next);
            joined.push(' ');
            joined.push_str(part.strip_suffix('\\').unwrap_or(part).trim_end());
            if !part.ends_with('\\') {
                break;
            }
        }
        Cow::Owned(joined.trim().to_owned())
    }
}

/// `text` up to a word that begins with `#`. A `#` inside a word stays, so that `1.#QNAN` is not read as 1.
fn without_comment(text: &str) -> &str {
    let begins_word = |at: usize| text[..at].chars().next_back().is_none_or(char::is_whitespace);
    text.match_indices('#').map(|(at, _)| at).find(|&at| begins_word(at)).map_or(text, |at| &text[..at])
}

/// Lines of a text, ended by LF, CR LF or CR alone.
#[derive(Debug)]
struct Lines<'t> {
    rest: &'t str,
    /// Number of the line last given out, from 1.
    line: usize,
}

impl<'t> Iterator for Lines<'t> {
    type Item = &'t str;

    fn next(&mut self) -> Option<&'t str> {
        if self.rest.is_empty() {
            return None;
        }
        self.line += 1;
        let Some(at) = self.rest.bytes().position(|byte| byte == b'\n' || byte == b'\r') else {
            return Some(std::mem::take(&mut self.rest));
        };
        let line = &self.rest[..at];
        let width = if self.rest[at..].starts_with("\r\n") { 2 } else { 1 };
        self.rest = &self.rest[at + width..];
        Some(line)
    }
}

/// Keywords no reader knows, each told once with its first line.
#[derive(Debug, Default)]
pub(super) struct UnknownKeywords {
    told: Vec<(String, usize)>,
    further: usize,
}

impl UnknownKeywords {
    /// Notes an unknown statement.
    pub fn note(&mut self, statement: &Statement) {
        if self.told.iter().any(|(keyword, _)| keyword == statement.keyword) {
            return;
        }
        if self.told.len() < UNKNOWN_TOLD {
            self.told.push((statement.keyword.to_owned(), statement.line));
        } else {
            self.further += 1;
        }
    }

    /// The warnings for `path`.
    pub fn warnings(&self, path: &Path) -> Vec<String> {
        let path = path.display();
        let mut warnings: Vec<String> = self
            .told
            .iter()
            .map(|(keyword, line)| {
                format!(
                    "{path}:{line}: unknown statement `{}`; it and others like it are ignored",
                    shown(keyword)
                )
            })
            .collect();
        if self.further > 0 {
            let those = counted(
                self.further,
                "further line with an unknown statement is ignored",
                "further lines with unknown statements are ignored",
            );
            warnings.push(format!("{path}: {those}"));
        }
        warnings
    }
}

/// A piece of the user's text as a message may show it: control characters escaped, long text cut.
pub(super) fn shown(text: &str) -> String {
    let mut letters = text.chars();
    let start: String = letters
        .by_ref()
        .take(SHOWN_LETTERS)
        .flat_map(|letter| {
            let escaped: String =
                if letter.is_control() { letter.escape_default().collect() } else { letter.into() };
            escaped.chars().collect::<Vec<_>>()
        })
        .collect();
    if letters.next().is_some() { start + "..." } else { start }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn list(text: &str) -> Vec<(usize, String, String)> {
        statements(text).map(|s| (s.line, s.keyword.to_owned(), s.rest.into_owned())).collect()
    }

    fn one(line: usize, keyword: &str, rest: &str) -> (usize, String, String) {
        (line, keyword.to_owned(), rest.to_owned())
    }

    #[test]
    fn all_three_line_ends_count_alike() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["# head", "v 1 2 3", "", "f\t1 2  3"].join(end);
            assert_eq!(list(&text), [one(2, "v", "1 2 3"), one(4, "f", "1 2  3")]);
        }
    }

    #[test]
    fn continued_lines_carry_the_line_they_begin_on() {
        let text = "f 1 2 \\\n 3 \\ \r\n4\nf\\\n5 6 7\nv 1 2 3 \\";
        assert_eq!(list(text), [one(1, "f", "1 2 3 4"), one(4, "f", "5 6 7"), one(6, "v", "1 2 3")]);
    }

    #[test]
    fn backslash_at_the_end_of_a_comment_swallows_nothing() {
        let text = "# C:\\scenes\\\nv 1 2 3 # from C:\\\nv 4 5 6";
        assert_eq!(list(text), [one(2, "v", "1 2 3"), one(3, "v", "4 5 6")]);
    }

    #[test]
    fn hash_is_a_letter_in_names_and_inside_words() {
        let text = "usemtl Material #25\ng a#b\nv 1.#QNAN 0 0 # note";
        assert_eq!(
            list(text),
            [one(1, "usemtl", "Material #25"), one(2, "g", "a#b"), one(3, "v", "1.#QNAN 0 0")]
        );
    }

    #[test]
    fn text_that_is_not_utf8_is_refused_with_its_line() {
        let path = Path::new("s.obj");
        let message = decode(path, b"v 0 0 0\r\n# K\xf6ln\n").unwrap_err().to_string();
        assert_eq!(message, "s.obj:2: byte 0xf6 is not UTF-8; save the file as UTF-8");
        let message = decode(path, b"\xff\xfev\0").unwrap_err().to_string();
        assert!(message.contains("UTF-16"), "{message}");
        assert_eq!(decode(path, "\u{feff}v".as_bytes()).unwrap(), "v");
    }

    #[test]
    fn messages_escape_control_characters_and_cut_long_text() {
        assert_eq!(shown("a\u{1b}[2Jb"), "a\\u{1b}[2Jb");
        assert_eq!(shown(&"x".repeat(100)).len(), SHOWN_LETTERS + 3);
    }
}
