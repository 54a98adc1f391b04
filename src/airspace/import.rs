//! `kittiwake airspace import`: new editions in a mission file.

use domain::area::Area;
use domain::file::Source;
use domain::mission::Mission;
use formats::assemble::assemble_airspace;
use formats::compare::{Difference, compare, of_areas};
use formats::replace::without_feeds;

use crate::airspace::args::ImportArgs;
use crate::airspace::diff::{document, lines_after};
use crate::airspace::{bad_input, feed_lines, own_areas, read_all, warnings};
use crate::operate::Done;
use crate::operate::convert::{in_words, refused, write_new};
use crate::operate::failure::Failure;
use crate::output::visible::one_line;

/// Writes the mission file with other feeds. What is written passes `kittiwake check`; if it would not, nothing is written.
pub(super) fn import(args: &ImportArgs) -> Result<Done, Failure> {
    let imports = read_all(&args.feeds.files)?;
    let source = Source::read(&args.mission).map_err(bad_input)?;
    let old = Mission::read(&source).map_err(bad_input)?;
    let path = args.mission.display();
    let origin = old.origin.ok_or_else(|| {
        let why = "the mission has no [origin], so nobody knows where it lies among the zones: give it one";
        Failure::bad_input(format!("{path}: {why}"))
    })?;
    args.feeds.replace_all(&old.feeds, &imports)?;
    let own = own_areas(&old.areas, &old.feeds);
    let assembled = assemble_airspace(&imports, origin, &own, &args.feeds.settings()).map_err(refused)?;
    let base = without_feeds(&source).map_err(bad_input)?;
    let text = format!("{}\n{}", base.trim_end(), assembled.text);
    let new = Mission::read(&Source { path: args.out.clone(), text: text.clone() }).map_err(|mistakes| {
        Failure::bad_input(format!("nothing was written, since the mission could not be flown:\n{mistakes}"))
    })?;
    write_new(&args.out, &text)?;
    let difference = of_feeds(&old.areas, &new.areas, &own);
    let mut told = in_words(&assembled.notes);
    if old.feeds.is_empty() && !own.is_empty() {
        told.push(format!("note: {path}: it names no feed: its {} areas are its own, and stay", own.len()));
    }
    told.extend(lines_after(&old.feeds, &difference));
    told.extend(feed_lines(&new.feeds));
    told.extend(warnings(&new.feeds));
    told.push(format!("written: {}: own areas: {}, from feeds: {}", args.out.display(), own.len(), assembled.areas));
    let mut document = document(&difference);
    document["written"] = args.out.display().to_string().into();
    // Lines of notes may be several.
    let text = told.iter().flat_map(|it| it.lines()).map(|it| one_line(it).into_owned()).collect::<Vec<_>>().join("\n");
    Ok(Done { document, text })
}

/// What differs between the areas that are not the mission's own.
pub(super) fn of_feeds(old: &[Area], new: &[Area], own: &[String]) -> Difference {
    let of_feeds = |areas: &[Area]| of_areas(areas.iter().filter(|it| !own.contains(&it.name)));
    compare(of_feeds(old), of_feeds(new))
}
