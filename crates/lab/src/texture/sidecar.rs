//! Writes roughness into the sidecar of a scene. People edit this file, so comments and order are kept.

use anyhow::{Context, ensure};
use std::io::ErrorKind;
use std::path::Path;
use toml::{Table, Value};

/// Sets the key `roughness` of surfaces in a sidecar, and creates a missing file. All other lines are unchanged. Returns whether the file is new.
///
/// # Errors
/// A file that is not TOML; a surface whose entry is not a table `[surface.NAME]` of its own; a file that cannot be written.
pub(super) fn write_roughness<'a>(
    path: &Path,
    entries: impl IntoIterator<Item = (&'a str, f64)>,
) -> anyhow::Result<bool> {
    let name = || path.display().to_string();
    let (mut text, is_new) = match std::fs::read_to_string(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => (String::new(), true),
        read => (read.with_context(name)?, false),
    };
    for (surface, roughness) in entries {
        text = with_roughness(&text, surface, roughness).with_context(name)?;
    }
    hwall_files::write(path, text).with_context(name)?;
    Ok(is_new)
}

fn with_roughness(text: &str, surface: &str, roughness: f64) -> anyhow::Result<String> {
    let before: Table = text.parse()?;
    let line = format!("roughness = {roughness:?}");
    let mut lines: Vec<&str> = text.lines().collect();
    let header = format!("[surface.{}]", key(surface));
    match lines.iter().position(|l| l.trim().starts_with(&header)) {
        Some(start) => {
            let own = lines[start + 1..]
                .iter()
                .take_while(|l| !l.trim().starts_with('['));
            let place = own.clone().position(|l| {
                let name = l.split_once('=').map(|(name, _)| name.trim());
                name == Some("roughness")
            });
            match place {
                Some(place) => lines[start + 1 + place] = &line,
                None => lines.insert(start + 1, &line),
            }
        }
        None => lines.extend(["", &header, &line]),
    }
    let end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    let after = lines.join(end) + end;
    // The lines were found without a parser, so check the result with one.
    let mut wanted = before;
    let surfaces = wanted
        .entry("surface")
        .or_insert_with(|| Value::Table(Table::new()));
    let table = surfaces.as_table_mut().context("surface is no table")?;
    let entry = table
        .entry(surface)
        .or_insert_with(|| Value::Table(Table::new()));
    let entry = entry
        .as_table_mut()
        .with_context(|| format!("surface.{surface} is no table"))?;
    entry.insert("roughness".to_owned(), Value::Float(roughness));
    ensure!(
        after.parse::<Table>().ok() == Some(wanted),
        "surface {surface} is not a table {header} of its own: write {line} there by hand"
    );
    Ok(after)
}

/// A name as a TOML key: bare if possible, else a basic string.
fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    if !name.is_empty() && name.chars().all(bare) {
        return name.to_owned();
    }
    // Strings of JSON are basic strings of TOML.
    serde_json::Value::from(name).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_changed_made_or_refused_and_all_else_stays() {
        let text = "# A room.\n\n[surface.door] # wood\nkind = \"static\"\nroughness = 0.4 # by hand\n\n[surface.floor]\nkind = \"untouchable\"\n";
        let changed = with_roughness(text, "door", 1.5).unwrap();
        assert_eq!(changed, text.replace("0.4 # by hand", "1.5"));
        let windows = text.replace('\n', "\r\n");
        let changed = with_roughness(&windows, "door", 1.5).unwrap();
        assert_eq!(changed, windows.replace("0.4 # by hand", "1.5"));
        let added = with_roughness(text, "floor", 2.0).unwrap();
        assert!(
            added.contains("[surface.floor]\nroughness = 2.0\nkind"),
            "{added}"
        );
        let made = with_roughness(text, "the \"wall\"", 0.021).unwrap();
        assert!(
            made.starts_with(text)
                && made.ends_with("[surface.\"the \\\"wall\\\"\"]\nroughness = 0.021\n")
        );
        assert_eq!(
            with_roughness("", "a", 1.0).unwrap(),
            "\n[surface.a]\nroughness = 1.0\n"
        );
        for inline in [
            "surface = { door = { roughness = 1 } }\n",
            "[surface]\ndoor.kind = \"static\"\n",
        ] {
            let refused = with_roughness(inline, "door", 1.0).unwrap_err().to_string();
            assert!(refused.contains("by hand"), "{refused}");
        }
        assert!(with_roughness("[", "a", 1.0).is_err());
    }
}
