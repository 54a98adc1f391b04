//! Configuration files of the measured systems: the given one with a few values changed.

use std::path::{Path, PathBuf};

use domain::file::Source;

/// What differs from the given configuration.
#[derive(Debug, Clone, Default)]
pub(crate) struct Variant {
    /// The mission manager's tick period.
    pub tick_ms: Option<u32>,
    /// Another contingency table, in `kpi` beside the configuration.
    pub contingencies: Option<&'static str>,
    /// Another mission, in `kpi` beside the configuration.
    pub mission: Option<&'static str>,
}

/// A folder for the files, removed with the value.
pub(crate) struct Folder(PathBuf);

impl Folder {
    /// One of this process's own.
    pub(crate) fn new() -> std::io::Result<Folder> {
        let path = std::env::temp_dir().join(format!("kittiwake-kpi-{}", std::process::id()));
        std::fs::create_dir_all(&path)?;
        Ok(Folder(path))
    }

    /// Writes the variant of `base` into the folder.
    pub(crate) fn write(&self, base: &Path, variant: &Variant) -> Result<PathBuf, String> {
        let source = Source::read(base).map_err(|it| it.to_string())?;
        let mut config: toml::Table = source.text.parse().map_err(|it| format!("{}: {it}", base.display()))?;
        let beside = base.canonicalize().map_err(|it| format!("{}: {it}", base.display()))?;
        let beside = beside.parent().unwrap_or(Path::new("/"));
        for (key, other) in [
            ("mission", variant.mission),
            ("contingencies", variant.contingencies),
            ("trees", None::<&str>),
            ("skills", None),
        ] {
            let path = match (other, config.get(key).and_then(|it| it.as_str())) {
                (Some(other), _) => beside.join("kpi").join(other),
                (None, Some(given)) => beside.join(given),
                (None, None) => continue,
            };
            config.insert(key.into(), path.display().to_string().into());
        }
        if let (Some(ms), Some(mcm)) = (variant.tick_ms, config.get_mut("mcm").and_then(|it| it.as_table_mut())) {
            mcm.insert("tick_period_ms".into(), f64::from(ms).into());
        }
        let name = format!(
            "{}-{}.toml",
            variant.contingencies.unwrap_or("mission").trim_end_matches(".toml"),
            variant.tick_ms.unwrap_or_default()
        );
        let path = self.0.join(name);
        std::fs::write(&path, config.to_string()).map_err(|it| format!("{}: {it}", path.display()))?;
        Ok(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed is a few kilobytes in a folder for such things.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use kittiwake::check_inputs;
    use kittiwake::settings::Settings;

    use super::*;

    #[test]
    fn the_tables_and_the_mission_of_the_measurements_are_sound() {
        let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/kittiwake.toml");
        let folder = Folder::new().unwrap();
        for table in ["flat.toml", "nested.toml"] {
            let variant = Variant { tick_ms: Some(10), contingencies: Some(table), mission: Some("mission.toml") };
            let config = folder.write(&base, &variant).unwrap();
            check_inputs::read(&Settings::of_file(&config)).map(drop).unwrap_or_else(|it| panic!("{table}: {it}"));
        }
    }
}
