//! Changes of single values in a profile's text that leave comments and order alone.

use std::ops::Range;

use super::scan::{self, Entry};

/// Overwrites `range` with blanks, so that all positions stay.
pub(super) fn blank(text: &mut String, range: Range<usize>) {
    if let Some(old) = text.get(range.clone()) {
        let blanks =
            old.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }).collect::<String>();
        text.replace_range(range, &blanks);
    }
}

/// `text` with `value` at `key`, in place of the old value or as a new last key of its
/// section; `None` when `text` has no outline.
pub(super) fn put(text: &str, key: &str, value: &str) -> Option<String> {
    let entries = scan::entries(text).ok()?;
    let mut new = text.to_owned();
    if let Some(entry) = entries.iter().find(|entry| entry.path == key) {
        new.replace_range(entry.value.clone(), value);
        return Some(new);
    }
    let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
    if !section.is_empty() && !entries.iter().any(|e| e.path == section && e.is_section) {
        return put(text, section, &format!("({name}: {value})"));
    }
    let close = match entries.iter().find(|entry| entry.path == section) {
        Some(entry) => entry.value.end - 1,
        None => closing_bracket(text, &entries)?,
    };
    let line = text[..close].rfind('\n').map_or(0, |newline| newline + 1);
    let indent = &text[line..close];
    let last = last_child(&entries, section);
    if indent.chars().all(char::is_whitespace) && line > 0 {
        new.insert_str(line, &format!("{indent}    {name}: {value},\n"));
    } else {
        let gap = if last.is_some() { " " } else { "" };
        new.insert_str(close, &format!("{gap}{name}: {value}"));
    }
    if let Some(last) = last.filter(|last| !last.has_comma()) {
        new.insert(last.value.end, ',');
    }
    Some(new)
}

/// The last key directly within `section`.
fn last_child<'a>(entries: &'a [Entry], section: &str) -> Option<&'a Entry> {
    let parent = |entry: &Entry| {
        entry.path.rsplit_once('.').map_or(String::new(), |(parent, _)| parent.to_owned())
    };
    entries.iter().rfind(|entry| parent(entry) == section)
}

/// The `)` that ends the profile: the first one after its last key that is in no comment.
fn closing_bracket(text: &str, entries: &[Entry]) -> Option<usize> {
    // Only the outline's own `)` completes it: each cut before it leaves the text broken.
    let from = last_child(entries, "").map_or(0, |last| last.end);
    let mut brackets = text.get(from..)?.match_indices(')').map(|(at, _)| from + at);
    brackets.find(|&at| text.get(..=at).is_some_and(|cut| scan::entries(cut).is_ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_replaced_and_its_comment_stays() {
        let text = "(\n    a: 1, // one\n    b: ( c: [2, 3] ),\n)";
        assert_eq!(put(text, "a", "7").unwrap(), text.replace("a: 1", "a: 7"));
        assert_eq!(put(text, "b.c", "[]").unwrap(), text.replace("[2, 3]", "[]"));
    }

    #[test]
    fn a_missing_key_is_added_at_the_end_of_its_section() {
        for (text, key, expected) in [
            ("()", "a", "(a: 9)"),
            ("(x: 1)", "a", "(x: 1, a: 9)"),
            ("(x: 1,)", "a", "(x: 1, a: 9)"),
            ("(\n    x: 1 // )\n)\n// )", "a", "(\n    x: 1, // )\n    a: 9,\n)\n// )"),
            ("(b: ())", "b.a", "(b: (a: 9))"),
            (
                "(\n    b: (\n        x: 1,\n    ),\n)",
                "b.a",
                "(\n    b: (\n        x: 1,\n        a: 9,\n    ),\n)",
            ),
            ("(\n)", "s.t.a", "(\n    s: (t: (a: 9)),\n)"),
        ] {
            assert_eq!(put(text, key, "9").unwrap(), expected);
        }
    }
}
