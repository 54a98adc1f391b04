//! What the parser of XML takes too long for: it compares each attribute of an element with each other one, and copies the namespaces
//! in force for each element that declares one. A megabyte could hold it up for hours.

use std::collections::BTreeSet;

/// The most attributes of an element, and the most prefixes of namespaces in a file. Files of the formats have a tenth.
const MOST: usize = 200;

/// Whether a text has few enough of both. Whether it is well-formed is for the parser to find.
pub(super) fn is_bounded(text: &str) -> bool {
    let mut prefixes: BTreeSet<&str> = BTreeSet::new();
    let mut rest = text;
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")].iter().find(|it| rest.starts_with(it.0));
        if let Some((begin, end)) = skipped {
            let Some(length) = rest[begin.len()..].find(end) else { return true };
            rest = &rest[begin.len() + length + end.len()..];
            continue;
        }
        rest = &rest[1..];
        let mut attributes = 0;
        // From value to value: an end of the element in one of them is not its end.
        while let Some(at) = rest.find(['>', '"', '\'']) {
            let (before, mark) = (&rest[..at], &rest[at..=at]);
            rest = &rest[at + 1..];
            if mark == ">" {
                break;
            }
            attributes += 1;
            if let Some(declaration) = before.rfind("xmlns") {
                prefixes.insert(&before[declaration..]);
            }
            if MOST < attributes || MOST < prefixes.len() {
                return false;
            }
            let Some(length) = rest.find(mark) else { return true };
            rest = &rest[length + 1..];
        }
    }
    true
}
