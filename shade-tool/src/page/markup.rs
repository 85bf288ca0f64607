//! Pieces of HTML: text made harmless, numbers for people, tables, figures. All that comes from a file goes through
//! [`escape`]: a group may be called `<script>`.

use std::fmt::Write;

/// Digits of numbers in tables: what a reader compares, not what the file holds.
const DIGITS: usize = 4;
/// Numbers are written out between these, else with a power of ten.
const WRITTEN_OUT: std::ops::Range<f64> = 1e-3..1e7;

/// Text as it stands between tags and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            other => safe.push(other),
        }
    }
    safe
}

/// A number of four digits as HTML.
pub fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !x.is_finite() {
        return if x.is_nan() { "–".into() } else { "∞".into() };
    }
    let rounded = format!("{x:.*e}", DIGITS - 1);
    let (digits, power) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    if WRITTEN_OUT.contains(&x.abs()) {
        let decimals = (DIGITS as i32 - 1 - power).max(0) as usize;
        return format!("{x:.decimals$}").replace('-', "−");
    }
    format!("{} × 10<sup>{}</sup>", digits.replace('-', "−"), power.to_string().replace('-', "−"))
}

/// A whole number with thin spaces between thousands.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A time for people.
pub fn seconds(s: f64) -> String {
    match s {
        s if s >= 100.0 => format!("{s:.0} s"),
        s if s >= 1.0 => format!("{s:.2} s"),
        s => format!("{:.1} ms", 1e3 * s),
    }
}

/// A table whose first column is text and whose others are numbers; cells are HTML.
#[derive(Debug, Default)]
pub struct Table {
    rows: String,
    head: String,
}

impl Table {
    /// A table with these titles.
    pub fn new(titles: &[&str]) -> Self {
        let cells: String = titles.iter().map(|t| format!("<th scope=\"col\">{}</th>", escape(t))).collect();
        Self { head: format!("<thead><tr>{cells}</tr></thead>"), rows: String::new() }
    }

    /// Adds a row: its name, which is escaped, and its cells.
    pub fn row(&mut self, name: &str, cells: impl IntoIterator<Item = String>) {
        let cells: String = cells.into_iter().map(|cell| format!("<td>{cell}</td>")).collect();
        let _ = writeln!(self.rows, "<tr><th scope=\"row\">{}</th>{cells}</tr>", escape(name));
    }

    /// The table; wide ones scroll by themselves.
    pub fn html(&self) -> String {
        format!("<div class=\"wide\"><table>{}<tbody>\n{}</tbody></table></div>\n", self.head, self.rows)
    }
}

/// A figure of some HTML under which a caption (HTML) stands.
pub fn figure(content: &str, caption: &str) -> String {
    format!("<figure>{content}<figcaption>{caption}</figcaption></figure>\n")
}

/// What is folded away until asked for.
pub fn folded(title: &str, content: &str) -> String {
    format!("<details><summary>{}</summary>{content}</details>\n", escape(title))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_harmless_in_tags_and_attributes() {
        assert_eq!(escape("<script>'a' & \"b\""), "&lt;script&gt;&#39;a&#39; &amp; &quot;b&quot;");
        let mut table = Table::new(&["<a>", "n"]);
        table.row("<b>", [number(1.0)]);
        assert!(!table.html().contains("<a>") && !table.html().contains("<b>"));
    }

    #[test]
    fn numbers_have_four_digits() {
        for (x, text) in [
            (0.0, "0"),
            (12.345678, "12.35"),
            (-0.5, "−0.5000"),
            (123456.7, "123457"),
            (1.5e-7, "1.500 × 10<sup>−7</sup>"),
            (f64::INFINITY, "∞"),
        ] {
            assert_eq!(number(x), text);
        }
        assert_eq!(count(1234567), "1\u{202f}234\u{202f}567");
        assert_eq!((seconds(0.0123), seconds(12.3)), ("12.3 ms".into(), "12.30 s".into()));
    }
}
