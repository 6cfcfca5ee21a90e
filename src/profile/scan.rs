//! Where the keys and values of a profile stand in its text.
//!
//! RON's deserialiser stops at the first fault and keeps no positions of what it read.
//! This scanner knows only the outline, `(key: value, …)`: enough to test every value on
//! its own, to point at each fault, and to edit one value and leave the comments alone.

use std::ops::Range;

/// One `key: value` of a profile's text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    /// The dotted path, such as `plant.pole_length_m`.
    pub path: String,
    /// Where the key stands.
    pub key: Range<usize>,
    /// Where the value stands.
    pub value: Range<usize>,
    /// The end of the entry, its comma included.
    pub end: usize,
    /// Whether the value is itself `(key: value, …)`.
    pub is_section: bool,
}

impl Entry {
    /// Whether a comma follows the value.
    pub fn has_comma(&self) -> bool {
        self.end > self.value.end
    }
}

/// Why a text has no outline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Broken {
    /// Where it breaks.
    pub at: Range<usize>,
    /// What is wrong or missing there.
    pub why: String,
}

/// Sections nested deeper than this are values like any other.
const DEEPEST_SECTION: usize = 8;

/// All entries of a profile, each section before the entries within it.
pub(super) fn entries(text: &str) -> Result<Vec<Entry>, Broken> {
    let mut scanner = Scanner { text, position: 0, entries: Vec::new() };
    scanner.skip_blank()?;
    while scanner.rest().starts_with("#!") {
        let length = scanner.rest().find(']').unwrap_or(scanner.rest().len() - 1) + 1;
        scanner.position += length;
        scanner.skip_blank()?;
    }
    if scanner.rest().is_empty() {
        return Err(scanner.broken("the profile is empty; it should begin with `(`"));
    }
    scanner.word();
    scanner.skip_blank()?;
    if scanner.peek() != Some('(') {
        return Err(scanner.broken("this is no profile: it should begin with `(`"));
    }
    scanner.fields("", 0)?;
    scanner.skip_blank()?;
    if scanner.rest().is_empty() {
        Ok(scanner.entries)
    } else {
        Err(scanner.broken("the profile's last `)` was before this; nothing may follow it"))
    }
}

/// Whether `text` is one value and nothing else.
pub(super) fn is_one_value(text: &str) -> bool {
    let mut scanner = Scanner { text, position: 0, entries: Vec::new() };
    scanner.skip_blank().is_ok()
        && scanner.value("", "").is_ok()
        && scanner.skip_blank().is_ok()
        && scanner.rest().is_empty()
}

struct Scanner<'a> {
    text: &'a str,
    position: usize,
    entries: Vec<Entry>,
}

impl<'a> Scanner<'a> {
    fn rest(&self) -> &'a str {
        self.text.get(self.position..).unwrap_or_default()
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn advance(&mut self) {
        self.position += self.peek().map_or(0, char::len_utf8);
    }

    fn broken(&self, why: impl Into<String>) -> Broken {
        let end = self.position + self.peek().map_or(0, char::len_utf8);
        Broken { at: self.position..end, why: why.into() }
    }

    /// The text ended within what `opened` at `open`.
    fn cut(&self, opened: &str, open: usize) -> Broken {
        let line = line_of(self.text, open);
        let end = self.text.trim_end().len();
        let at = self.text[..end].char_indices().next_back().map_or(0, |(at, _)| at);
        Broken {
            at: at..end,
            why: format!(
                "the file ends before {opened} of line {line} is closed; was it cut off here?"
            ),
        }
    }

    /// Passes blanks and comments.
    fn skip_blank(&mut self) -> Result<(), Broken> {
        loop {
            let blank = |c: char| c.is_whitespace() || matches!(c, '\u{200e}' | '\u{200f}');
            let rest = self.rest().trim_start_matches(blank);
            self.position = self.text.len() - rest.len();
            if rest.starts_with("//") {
                self.position += rest.find('\n').unwrap_or(rest.len());
            } else if rest.starts_with("/*") {
                self.skip_block_comment()?;
            } else {
                return Ok(());
            }
        }
    }

    fn skip_block_comment(&mut self) -> Result<(), Broken> {
        let open = self.position;
        let mut depth = 0_usize;
        loop {
            let rest = self.rest();
            if rest.starts_with("/*") {
                depth += 1;
                self.position += 2;
            } else if rest.starts_with("*/") {
                depth -= 1;
                self.position += 2;
            } else if rest.is_empty() {
                return Err(self.cut("the comment `/*`", open));
            } else {
                self.advance();
            }
            if depth == 0 {
                return Ok(());
            }
        }
    }

    /// Takes a name or number: everything up to a blank, a bracket or a mark.
    fn word(&mut self) -> &'a str {
        let rest = self.rest();
        let ends = |c: char| c.is_whitespace() || "()[]{},:\"'/".contains(c);
        let word = &rest[..rest.find(ends).unwrap_or(rest.len())];
        self.position += word.len();
        word
    }

    /// Takes `(key: value, …)`; `section` is its path.
    fn fields(&mut self, section: &str, depth: usize) -> Result<(), Broken> {
        let open = self.position;
        let opened =
            if section.is_empty() { "the `(`".to_owned() } else { format!("`{section}: (`") };
        self.advance();
        loop {
            self.skip_blank()?;
            match self.peek() {
                None => return Err(self.cut(&opened, open)),
                Some(')') => {
                    self.advance();
                    return Ok(());
                }
                Some(_) => self.field(section, &opened, open, depth)?,
            }
        }
    }

    /// Takes `key: value` and the comma after it.
    fn field(
        &mut self,
        section: &str,
        opened: &str,
        open: usize,
        depth: usize,
    ) -> Result<(), Broken> {
        let start = self.position;
        let key = self.word();
        if key.is_empty() {
            return Err(self.broken("here should be a key, such as `tick_ms: 20.0`, or a `)`"));
        }
        let path = if section.is_empty() { key.to_owned() } else { format!("{section}.{key}") };
        let key = start..self.position;
        self.skip_blank()?;
        match self.peek() {
            Some(':') => self.advance(),
            None => return Err(self.cut(opened, open)),
            Some(_) => {
                let why = format!("a colon is missing after `{path}`, as in `{path}: value`");
                return Err(Broken { at: key, why });
            }
        }
        self.skip_blank()?;
        let index = self.entries.len();
        let value = self.position;
        let is_section = depth < DEEPEST_SECTION && self.is_at_fields();
        self.entries.push(Entry {
            path: path.clone(),
            key,
            value: value..value,
            end: value,
            is_section,
        });
        if is_section {
            self.fields(&path, depth + 1)?;
        } else {
            if self.peek().is_none() {
                return Err(self.cut(opened, open));
            }
            self.value(&path, opened)?;
        }
        let value = value..self.position;
        self.skip_blank()?;
        let end = match self.peek() {
            Some(',') => {
                self.advance();
                self.position
            }
            Some(')') => value.end,
            None => return Err(self.cut(opened, open)),
            Some(_) => {
                let why = format!("a comma is missing after the value of `{path}`");
                return Err(Broken { at: value, why });
            }
        };
        if let Some(entry) = self.entries.get_mut(index) {
            entry.value = value;
            entry.end = end;
        }
        Ok(())
    }

    /// Whether `(`, then nothing or a key and a colon, stands here.
    fn is_at_fields(&self) -> bool {
        let mut ahead = Scanner { text: self.text, position: self.position, entries: Vec::new() };
        if ahead.peek() != Some('(') {
            return false;
        }
        ahead.advance();
        if ahead.skip_blank().is_err() {
            return false;
        }
        if ahead.peek() == Some(')') {
            return true;
        }
        !ahead.word().is_empty() && ahead.skip_blank().is_ok() && ahead.peek() == Some(':')
    }

    /// Takes one value: a text, a character, a number, a name, brackets, or a name with
    /// brackets.
    fn value(&mut self, path: &str, section: &str) -> Result<(), Broken> {
        if self.quoted()? {
            return Ok(());
        }
        let word = self.word();
        let end = self.position;
        self.skip_blank()?;
        match self.peek() {
            Some('(') => self.brackets(),
            Some('[' | '{') if word.is_empty() => self.brackets(),
            _ if word.is_empty() => {
                let within = if section.is_empty() { "" } else { " within " };
                Err(self.broken(format!("`{path}`{within}{section} has no value here")))
            }
            _ => {
                self.position = end;
                Ok(())
            }
        }
    }

    /// Takes a text or character in quotes, if one stands here.
    fn quoted(&mut self) -> Result<bool, Broken> {
        let open = self.position;
        let rest = self.rest();
        let prefix = rest.len() - rest.trim_start_matches(['b', 'r', 'c']).len();
        let raw = rest[..prefix].contains('r');
        let hashes = if raw {
            rest[prefix..].len() - rest[prefix..].trim_start_matches('#').len()
        } else {
            0
        };
        let quote = match rest[prefix + hashes..].chars().next() {
            Some('"') => '"',
            Some('\'') if !raw => '\'',
            _ => return Ok(false),
        };
        self.position += prefix + hashes + 1;
        if raw {
            let close = format!("\"{}", "#".repeat(hashes));
            let length = self.rest().find(&close).ok_or_else(|| self.cut("the text", open))?;
            self.position += length + close.len();
            return Ok(true);
        }
        loop {
            match self.peek() {
                None => return Err(self.cut("the text in quotes", open)),
                Some('\\') => {
                    self.advance();
                    self.advance();
                }
                Some(c) => {
                    self.advance();
                    if c == quote {
                        return Ok(true);
                    }
                }
            }
        }
    }

    /// Takes everything up to the bracket that closes the one here.
    fn brackets(&mut self) -> Result<(), Broken> {
        let mut open = Vec::new();
        loop {
            self.skip_blank()?;
            if self.quoted()? {
                continue;
            }
            match self.peek() {
                None => {
                    let (bracket, at) = open.last().copied().unwrap_or(('(', 0));
                    return Err(self.cut(&format!("the `{bracket}`"), at));
                }
                Some(c @ ('(' | '[' | '{')) => open.push((c, self.position)),
                Some(c @ (')' | ']' | '}')) => {
                    let fits = match c {
                        ')' => '(',
                        ']' => '[',
                        _ => '{',
                    };
                    match open.pop() {
                        Some((bracket, _)) if bracket == fits => {}
                        Some((bracket, at)) => {
                            let line = line_of(self.text, at);
                            return Err(self.broken(format!(
                                "this `{c}` does not close the `{bracket}` of line {line}"
                            )));
                        }
                        None => return Err(self.broken(format!("nothing is open for this `{c}`"))),
                    }
                }
                Some(_) if !self.word().is_empty() => continue,
                Some(_) => {}
            }
            self.advance();
            if open.is_empty() {
                return Ok(());
            }
        }
    }
}

/// The line, from 1, in which the byte `at` of `text` stands.
pub(super) fn line_of(text: &str, at: usize) -> usize {
    1 + text.bytes().take(at).filter(|&byte| byte == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn outline(text: &str) -> Vec<(String, &str)> {
        let entries = entries(text).unwrap();
        entries.iter().map(|e| (e.path.clone(), &text[e.value.clone()])).collect()
    }

    #[test]
    fn keys_and_values_are_found_between_comments_and_quotes() {
        let text = "#![enable(implicit_some)]\n// a ( title\nProfile(a: 1.0, /* ( /* */ */ b: (\n\
                    c: \"x), \\\" y\", d: r#\"\"),\"#, e: [(1, ')'), b], // (\n f: None), g: Some(3))";
        let shown: Vec<_> = outline(text);
        let shown: Vec<_> = shown.iter().map(|(path, value)| (path.as_str(), *value)).collect();
        assert_eq!(shown[0], ("a", "1.0"));
        assert_eq!(shown[1].0, "b");
        assert_eq!(shown[2], ("b.c", "\"x), \\\" y\""));
        assert_eq!(shown[3], ("b.d", "r#\"\"),\"#"));
        assert_eq!(shown[4], ("b.e", "[(1, ')'), b]"));
        assert_eq!(shown[5], ("b.f", "None"));
        assert_eq!(shown[6], ("g", "Some(3)"));
    }

    #[test]
    fn what_is_missing_is_said_where_it_is_missing() {
        for (text, at, why) in [
            ("", 0..0, "empty"),
            ("  [1]", 2..3, "begin with `(`"),
            ("(a: 1", 4..5, "cut off"),
            ("(a: 1 b: 2)", 4..5, "a comma is missing after the value of `a`"),
            ("(a 1)", 1..2, "a colon is missing after `a`"),
            ("(a: )", 4..5, "`a` within the `(` has no value"),
            ("(a: [1)", 6..7, "does not close the `[` of line 1"),
            ("(a: \"b)", 6..7, "the text in quotes of line 1"),
            ("(a: 1))", 6..7, "nothing may follow"),
            ("(\n\nb: (c: 1,\n", 11..12, "`b: (` of line 3"),
        ] {
            let broken = entries(text).unwrap_err();
            assert_eq!(broken.at, at, "{text}");
            assert!(broken.why.contains(why), "{text}: {}", broken.why);
        }
    }

    proptest! {
        #[test]
        fn no_text_breaks_the_scanner(text in r#"[(){}\[\],:"'a1 /*#r\\\n\u{e9}.]{0,60}"#) {
            for inner in [text.clone(), format!("(a: {text}"), format!("(a: {text}, b: 1)")] {
                match entries(&inner) {
                    Ok(entries) => for entry in entries {
                        prop_assert!(inner.get(entry.key).is_some());
                        prop_assert!(inner.get(entry.value).is_some());
                    },
                    Err(broken) => prop_assert!(inner.get(broken.at).is_some()),
                }
            }
        }
    }
}
