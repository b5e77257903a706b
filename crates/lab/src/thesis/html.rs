//! A document of this project as a page of one file: the Markdown that its templates and tables use, with its figures inside.

use crate::report::fill;
use anyhow::Context;
use std::fs;
use std::path::Path;

/// The page of a document; `folder`: where its figures are.
///
/// # Errors
/// A figure that cannot be read.
pub(super) fn page(markdown: &str, folder: &Path) -> anyhow::Result<String> {
    let title = markdown.lines().next().unwrap_or_default();
    let title = escaped(title.trim_start_matches(['#', ' ']));
    let (mut body, mut contents) = (String::new(), String::new());
    for block in markdown.split("\n\n").map(str::trim) {
        let lines: Vec<&str> = block.lines().collect();
        let hashes = block.bytes().take_while(|b| *b == b'#').count();
        if block.is_empty() {
        } else if (1..=6).contains(&hashes) {
            let text = inline(block[hashes..].trim());
            let id = format!("s{}", body.len());
            body += &format!("<h{hashes} id=\"{id}\">{text}</h{hashes}>\n");
            if hashes > 1 {
                contents += &format!("<a class=\"h{hashes}\" href=\"#{id}\">{text}</a>\n");
            }
        } else if let Some((caption, file)) = image(block) {
            let path = folder.join(file);
            let svg = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
            // A figure within a page needs no name space.
            let svg = svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
            let caption = inline(caption);
            body += &format!("<figure>{svg}<figcaption>{caption}</figcaption></figure>\n");
        } else if block.starts_with('|') {
            body += &table(&lines);
        } else if block.starts_with("- ") {
            let items = format!("\n{block}");
            let items = items.split("\n- ").skip(1);
            let items: String = items
                .map(|item| format!("<li>{}</li>\n", inline(item)))
                .collect();
            body += &format!("<ul>\n{items}</ul>\n");
        } else {
            body += &format!("<p>{}</p>\n", inline(block));
        }
    }
    fill(
        include_str!("page.html"),
        &[("title", &title), ("contents", &contents), ("body", &body)],
    )
}

/// Caption and file of a block that is a figure.
fn image(block: &str) -> Option<(&str, &str)> {
    let (caption, file) = block.strip_prefix("![")?.split_once("](")?;
    Some((caption, file.strip_suffix(')')?))
}

/// A table; its second line is the rule below the titles.
fn table(lines: &[&str]) -> String {
    let row = |line: &&str, tag: &str| {
        // Bars within cells are escaped.
        let line = line.trim().trim_matches('|').replace("\\|", "\u{1}");
        let cells = line.split('|').map(|cell| {
            let cell = inline(&cell.trim().replace('\u{1}', "|"));
            format!("<{tag}>{cell}</{tag}>")
        });
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let titles = lines.first().map(|line| row(line, "th"));
    let rows: String = lines.iter().skip(2).map(|line| row(line, "td")).collect();
    let titles = titles.unwrap_or_default();
    format!("<div class=\"wide\"><table>\n{titles}{rows}</table></div>\n")
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

/// Code, bold, italics and links; of a link within the project its text.
fn inline(text: &str) -> String {
    let mut html = String::new();
    for (i, part) in text.split('`').enumerate() {
        html += &match i % 2 {
            1 => format!("<code>{}</code>", escaped(part)),
            _ => marked(&marked(&unlinked(&escaped(part)), "**", "b"), "*", "i"),
        };
    }
    html
}

/// Every second part between marks in a tag.
fn marked(text: &str, mark: &str, tag: &str) -> String {
    let parts = text.split(mark).enumerate();
    let part = |(i, part): (usize, &str)| match i % 2 {
        1 => format!("<{tag}>{part}</{tag}>"),
        _ => part.to_owned(),
    };
    parts.map(part).collect()
}

/// The text with each link replaced by what it shows.
fn unlinked(text: &str) -> String {
    let mut parts = text.split("](");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        if let Some(open) = plain.rfind('[') {
            plain.remove(open);
        }
        plain += part.split_once(')').map_or(part, |(_, rest)| rest);
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_becomes_one_file() {
        let folder = std::env::temp_dir().join(format!("hwall_html_{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let svg = "<svg width=\"1\" xmlns=\"http://www.w3.org/2000/svg\"><circle/></svg>";
        fs::write(folder.join("a.svg"), svg).unwrap();
        let text = "# A < B\n\n## C\n\n| x | y |\n| --- | --- |\n| `1 \\| 2` | **3** *4* |\n\n- one\n  two\n- [D](D.md)\n\n![E](a.svg)\n\nF";
        let page = page(text, &folder).unwrap();
        for part in [
            "<title>A &lt; B</title>",
            "<th>x</th>",
            "<td><code>1 | 2</code></td><td><b>3</b> <i>4</i></td>",
            "<li>one\n  two</li>",
            "<li>D</li>",
            "<svg width=\"1\"><circle/></svg><figcaption>E</figcaption>",
            "<p>F</p>",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
        assert!(page.find("class=\"h2\"").unwrap() < page.find("<h2").unwrap());
        assert!(super::page("![E](none.svg)", &folder).is_err());
        let _ = fs::remove_dir_all(&folder);
    }
}
