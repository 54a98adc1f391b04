//! `kittiwake airspace diff`, and a difference in words.

use domain::feed::Feed;
use domain::geodesy::LocalFrame;
use formats::Import;
use formats::compare::{Change, Difference, Item, compare, of_zones, times};
use formats::content::Zone;
use formats::inspect::{bounds, middle, within};
use serde_json::{Value, json};

use crate::airspace::args::DiffArgs;
use crate::airspace::{edition, page, read_all};
use crate::operate::Done;
use crate::operate::failure::Failure;
use crate::output::visible::one_line;
use crate::plan::now;

pub(super) fn diff(args: &DiffArgs) -> Result<Done, Failure> {
    let imports = read_all([&args.old, &args.new])?;
    let zones: Vec<Vec<Zone>> = imports.iter().map(|it| near(it, args)).collect();
    let centre = args.reach.origin.map(|it| it.place);
    let box_of_both = || bounds(&zones.concat()).map(middle);
    let frame = centre.or_else(box_of_both).map(LocalFrame::at);
    let difference = match &frame {
        Some(frame) => compare(of_zones(&zones[0], frame), of_zones(&zones[1], frame)),
        None => Difference::default(),
    };
    let utc_ms = now().utc_ms;
    let heads: Vec<String> = imports.iter().flat_map(|it| head(it, utc_ms)).collect();
    if let Some(path) = &args.html {
        regular_file::write(path, page::page(&heads, &difference))
            .map_err(|error| Failure::bad_input(format!("{}: cannot be written: {error}", path.display())))?;
    }
    let mut document = document(&difference);
    document["editions"] = imports.iter().map(|it| edition(&it.feed(), utc_ms)).collect();
    let text = heads.into_iter().chain(lines(&difference)).map(|it| one_line(&it).into_owned());
    Ok(Done { document, text: text.collect::<Vec<_>>().join("\n") })
}

fn near(import: &Import, args: &DiffArgs) -> Vec<Zone> {
    let zones = &import.content.zones;
    match args.reach.origin {
        Some(origin) => within(zones, origin.place, args.reach.within * 1000.0),
        None => zones.clone(),
    }
}

/// Which edition a file is, and which of its zones are not compared.
fn head(import: &Import, utc_ms: i64) -> Vec<String> {
    let (path, feed) = (import.path.display(), import.feed());
    let lost = import.content.without_shape().count();
    let lost =
        (0 < lost).then(|| format!("WARNING: {path}: {lost} zones have no shape that can be read: not compared"));
    let head = format!("{path}: {}, {}", import.format, feed.in_words());
    let out_of_date = feed.out_of_date(utc_ms).map(|it| format!("WARNING: {path}: {it}"));
    std::iter::once(head).chain(out_of_date).chain(lost).collect()
}

/// A line for each zone that differs, and one with the numbers.
pub(super) fn lines(difference: &Difference) -> Vec<String> {
    let Difference { closed, opened, changed, unchanged } = difference;
    let whole = |it: &Item| format!("{} `{}`, {}, {}", it.kind, it.name, it.band, times(it));
    let closed_lines = closed.iter().map(|it| format!("closed: {}", whole(it)));
    let opened_lines = opened.iter().map(|it| format!("opened: {}", whole(it)));
    let changed_lines = changed.iter().map(change);
    let numbers = format!(
        "closed: {}, opened: {}, changed: {}, unchanged: {}",
        closed.len(),
        opened.len(),
        changed.len(),
        unchanged.len()
    );
    closed_lines.chain(opened_lines).chain(changed_lines).chain([numbers]).collect()
}

/// The same for a mission whose feeds were these; where it had none, only the numbers: every zone is new.
pub(super) fn lines_after(feeds: &[Feed], difference: &Difference) -> Vec<String> {
    let mut lines = lines(difference);
    if feeds.is_empty() {
        lines.drain(..lines.len() - 1);
    }
    lines
}

fn change(it: &Change) -> String {
    format!("changed: {} `{}`: {}", it.new.kind, it.new.name, it.what.join("; "))
}

/// The same for programs.
pub(super) fn document(difference: &Difference) -> Value {
    let item = |it: &Item| json!({ "name": it.name, "kind": it.kind, "heights": it.band, "times": it.times });
    let list = |items: &[Item]| -> Vec<Value> { items.iter().map(item).collect() };
    let changed =
        |it: &Change| json!({ "name": it.new.name, "was": item(&it.old), "is": item(&it.new), "what": it.what });
    json!({
        "same": difference.is_empty(),
        "closed": list(&difference.closed),
        "opened": list(&difference.opened),
        "changed": difference.changed.iter().map(changed).collect::<Vec<_>>(),
        "unchanged": difference.unchanged.len(),
    })
}
