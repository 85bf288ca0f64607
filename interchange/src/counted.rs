//! Counts in messages: one of a thing, or several of them.

/// The count with what is counted: `one` (and its verb) where it is 1, `many` else.
///
/// ```
/// use interchange::counted::counted;
/// assert_eq!(counted(1, "face was dropped", "faces were dropped"), "1 face was dropped");
/// assert_eq!(counted(0, "face", "faces"), "0 faces");
/// ```
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
