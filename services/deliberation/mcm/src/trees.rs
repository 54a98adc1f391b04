//! The tree files, read and checked together with the contingency subtree generated from the table.

use std::path::Path;
use std::sync::Arc;

use behavior_tree::{Document, Element, Library, LoadError};
use domain::contingency::{Action, Contingencies, Row, Severity};
use domain::file::{Mistake, Mistakes, Place, Source};

use crate::leaves::registry;
use crate::world::World;

const FILES: [&str; 3] = ["mission.xml", "step.xml", "actions.xml"];

/// The tree files of a folder, before the contingency table is known.
pub struct Trees {
    sources: Vec<Source>,
    actions: Vec<String>,
}

impl Trees {
    /// Reads the tree files in `folder` and finds out which actions there are.
    pub fn read(folder: &Path) -> Result<Trees, Mistakes> {
        let mut mistakes = Vec::new();
        let mut sources = Vec::new();
        for name in FILES {
            match Source::read(&folder.join(name)) {
                Ok(source) => sources.push(source),
                Err(unreadable) => mistakes.extend(unreadable.0),
            }
        }
        Mistakes(mistakes).or(())?;
        let actions = load(&sources[2..], None)?.ids().map(str::to_owned).collect();
        Ok(Trees { sources, actions })
    }

    /// The actions that a contingency row may name: the trees of `actions.xml`.
    pub fn actions(&self) -> Vec<&str> {
        self.actions.iter().map(String::as_str).collect()
    }

    /// Checks everything together: the files and the subtree made from `table`.
    pub fn load(&self, table: &Contingencies) -> Result<LoadedTrees, Mistakes> {
        let mut sources = self.sources.clone();
        sources.push(Source { path: "contingencies (generated)".into(), text: contingency_xml(table) });
        Ok(LoadedTrees(Arc::new(load(&sources, Some(table))?)))
    }
}

/// Trees that were loaded and checked.
#[derive(Clone)]
pub struct LoadedTrees(pub(crate) Arc<Library<World>>);

/// The contingency subtree as XML.
pub fn contingency_xml(table: &Contingencies) -> String {
    let mut branches: Vec<Element> = Vec::new();
    let mut groups = Vec::new();
    // One that only slows responds never.
    let rows = || table.rows().iter().filter(|row| !row.only_slows());
    for row in rows() {
        let Some(group) = row.group else {
            branches.push(branch(row));
            continue;
        };
        if groups.contains(&group) {
            continue;
        }
        groups.push(group);
        // In the place of the most urgent one: their order does not matter, since no more than one of all rows responds.
        let members = rows().filter(|it| it.group == Some(group)).map(branch);
        branches.push(
            Element::new("ReactiveSequence")
                .attribute("name", &format!("group {group}"))
                .child(Element::new("GroupResponds").attribute("group", group.name()))
                .child(
                    Element::new("ReactiveFallback")
                        .attribute("name", &format!("{group}: the row that responds"))
                        .children(members),
                ),
        );
    }
    let root = Element::new("ReactiveFallback").attribute("name", "contingency behavior").children(branches);
    Document::new().tree("contingencies", root).to_xml()
}

/// A row: as long as it is the one that responds, its actions are tried in order, and from the first one again when all
/// have failed. A sequence with memory, so that a response under way does not depend on its condition any more.
fn branch(row: &Row) -> Element {
    let leaf = |tag: &str| Element::new(tag).attribute("flag", &row.flag);
    let actions = row.actions.iter().enumerate().map(|(index, action)| tries(row, index, action));
    let chain =
        Element::new("Fallback").attribute("name", &format!("{}: {}", row.flag, row.response())).children(actions);
    let response = Element::new("Sequence")
        .attribute("name", &format!("respond to {}", row.flag))
        .child(leaf("BeginResponse"))
        .child(
            retry(-1, Element::new("Sequence").child(chain).child(leaf("ResetFlag")))
                .attribute("name", &format!("until {} is over", row.flag)),
        );
    Element::new("ReactiveSequence").attribute("name", &row.flag).child(leaf("Responds")).child(response)
}

/// All tries of an action, each only if it is possible. The last action is tried whatever is missing.
fn tries(row: &Row, index: usize, action: &Action) -> Element {
    let of_action = |tag: &str| Element::new(tag).attribute("action", &index.to_string());
    let flown = match action.severity {
        // Somebody else flies: nothing is commanded.
        Severity::Yield => Element::new("AlwaysSuccess").attribute("name", &action.tree),
        _ => Element::new("SubTree").attribute("ID", &action.tree),
    };
    let may_be_impossible = !action.needs.is_empty() || action.severity == Severity::Land;
    let tried = match may_be_impossible && index + 1 < row.actions.len() {
        true => Element::new("Sequence").child(of_action("IsPossible")).child(flown),
        false => flown,
    };
    let attempt = Element::new("Sequence")
        .child(of_action("AwaitTry"))
        .child(Element::new("Fallback").child(tried).child(Element::new("TryFailed")));
    let name = format!("{} {}: {}, {} tries", row.flag, index + 1, action.tree, action.tries);
    retry(i64::from(action.tries), attempt).attribute("name", &name)
}

fn retry(attempts: i64, child: Element) -> Element {
    Element::new("RetryUntilSuccessful").attribute("num_attempts", &attempts.to_string()).child(child)
}

fn load(sources: &[Source], table: Option<&Contingencies>) -> Result<Library<World>, Mistakes> {
    let documents: Vec<(String, &str)> =
        sources.iter().map(|it| (it.path.display().to_string(), it.text.as_str())).collect();
    Library::load(&registry(table), documents).map_err(|errors| {
        let mut mistakes: Vec<Mistake> = errors.errors.iter().map(|it| mistake(it, sources)).collect();
        if errors.left_out > 0 {
            let message = format!("{} more mistakes are not listed", errors.left_out);
            mistakes.push(Mistake { path: sources[0].path.clone(), place: None, message, help: String::new() });
        }
        Mistakes(mistakes)
    })
}

fn mistake(error: &LoadError, sources: &[Source]) -> Mistake {
    let source = sources.iter().find(|it| it.path.display().to_string() == error.file);
    let line = source.and_then(|it| it.text.lines().nth(error.line as usize - 1)).unwrap_or_default();
    Mistake {
        path: error.file.clone().into(),
        place: Some(Place { line: error.line as usize, column: error.column as usize, text: line.to_owned() }),
        message: error.mistake.to_string(),
        help: error.mistake.hint().unwrap_or_default(),
    }
}
