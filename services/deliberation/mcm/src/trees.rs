//! The tree files, read and checked together with the contingency subtree generated from the table.

use std::path::Path;
use std::sync::Arc;

use behavior_tree::{Document, Element, Library, LoadError};
use domain::contingency::{Contingencies, Row};
use domain::file::{Mistake, Mistakes, Place, Source};

use crate::leaves::registry;
use crate::world::World;

/// A step may ask for up to so many permissions at once; the planner never groups more borders.
const MOST_PERMISSIONS: usize = 16;

const FILES: [&str; 4] = ["mission.xml", "step.xml", "step_asking.xml", "actions.xml"];

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
        let actions = load(&sources[3..], None)?.ids().map(str::to_owned).collect();
        Ok(Trees { sources, actions })
    }

    /// The actions that a contingency row may name: the trees of `actions.xml`.
    pub fn actions(&self) -> Vec<&str> {
        self.actions.iter().map(String::as_str).collect()
    }

    /// Everything together, checked: the files and the subtree that `table` becomes.
    pub fn load(&self, table: &Contingencies) -> Result<LoadedTrees, Mistakes> {
        let mut sources = Vec::new();
        for source in &self.sources {
            if source.path.ends_with("step_asking.xml") {
                sources.extend((1..=MOST_PERMISSIONS).map(|count| for_count(source, count)));
            } else {
                sources.push(source.clone());
            }
        }
        sources.push(Source { path: "contingencies (generated)".into(), text: contingency_xml(table) });
        Ok(LoadedTrees(Arc::new(load(&sources, Some(table))?)))
    }
}

/// Trees that were loaded and checked.
#[derive(Clone)]
pub struct LoadedTrees(pub(crate) Arc<Library<World>>);

/// The contingency subtree in XML, as it is flown.
pub fn contingency_xml(table: &Contingencies) -> String {
    let mut branches: Vec<Element> = Vec::new();
    let mut rows = table.rows().iter().peekable();
    while let Some(row) = rows.next() {
        let Some(group) = &row.group else {
            branches.push(branch(row));
            continue;
        };
        let mut members = vec![branch(row)];
        while let Some(next) = rows.next_if(|it| it.group.as_ref() == Some(group)) {
            members.push(branch(next));
        }
        branches.push(
            Element::new("ReactiveSequence")
                .attribute("name", &format!("group {group}"))
                .child(Element::new("GroupRaised").attribute("group", group))
                .child(
                    Element::new("ReactiveFallback")
                        .attribute("name", &format!("{group}, most urgent first"))
                        .children(members),
                ),
        );
    }
    let root = Element::new("ReactiveFallback").attribute("name", "contingency behavior").children(branches);
    Document::new().tree("contingencies", root).to_xml()
}

/// A row: a sequence with memory, so that a response under way is not asked again whether its value is still bad.
fn branch(row: &Row) -> Element {
    let leaf = |tag: &str| Element::new(tag).attribute("flag", &row.flag);
    let action = |id: &String| Element::new("SubTree").attribute("ID", id);
    Element::new("Sequence")
        .attribute("name", &row.flag)
        .child(leaf("FlagRaised"))
        .child(leaf("BeginResponse"))
        .child(
            Element::new("Fallback")
                .attribute("name", &format!("respond to {}", row.flag))
                .children(row.actions.iter().map(action))
                .child(action(&row.emergency))
                .child(leaf("MissionOver")),
        )
        .child(leaf("ResetFlag"))
}

/// The template of a step that asks for `count` permissions; lines keep their numbers.
fn for_count(source: &Source, count: usize) -> Source {
    let line = |line: &str| match line.trim_start().starts_with('<') && line.contains("INDEX") {
        true => (1..=count).map(|index| line.trim().replace("INDEX", &index.to_string())).collect(),
        false => line.to_owned(),
    };
    let text: Vec<String> = source.text.lines().map(line).collect();
    let path = if count == 1 { source.path.clone() } else { format!("{} ({count})", source.path.display()).into() };
    Source { path, text: text.join("\n").replace("COUNT", &count.to_string()) }
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
