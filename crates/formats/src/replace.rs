//! A new edition of the data sets in a mission file: what a human wrote stays as it is, with its comments.

use domain::file::{Mistake, Mistakes, Source};
use toml_edit::{DocumentMut, Item};

/// The text of a mission file without its feeds, and without the areas that came from them.
///
/// # Errors
/// If it is not TOML.
pub fn without_feeds(source: &Source) -> Result<String, Mistakes> {
    let mut document: DocumentMut = source.text.parse().map_err(|error: toml_edit::TomlError| {
        let message = error.message().to_owned();
        Mistakes(vec![Mistake { help: String::new(), ..source.mistake(error.span(), message, "") }])
    })?;
    document.remove("feed");
    if let Some(Item::ArrayOfTables(areas)) = document.get_mut("area") {
        areas.retain(|it| !it.contains_key("feed"));
    }
    if let Some(Item::Value(toml_edit::Value::Array(areas))) = document.get_mut("area") {
        areas.retain(|it| it.as_inline_table().is_none_or(|it| !it.contains_key("feed")));
    }
    Ok(document.to_string())
}
