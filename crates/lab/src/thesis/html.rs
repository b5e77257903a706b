//! A document of this project as a page of one file, with its figures inside.

use crate::report::template;
use anyhow::Context;
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd, html::push_html};
use std::fs;
use std::path::Path;

const FIGURE_END: &str = "</figcaption></figure>\n";

/// The page of a document; `folder`: where its figures are.
///
/// # Errors
/// A figure that cannot be read.
pub(super) fn page(markdown: &str, folder: &Path) -> anyhow::Result<String> {
    let (mut title, mut contents) = (String::new(), String::new());
    let mut events = Vec::new();
    // The text of a heading begins here.
    let mut text_from = 0;
    let raw = |html: &'static str| Event::Html(html.into());
    for mut event in Parser::new_ext(markdown, Options::ENABLE_TABLES) {
        if let Event::Start(Tag::Heading { id, .. }) = &mut event {
            *id = Some(format!("s{}", events.len()).into());
            text_from = events.len() + 1;
        }
        match event {
            // Keep only the text of a link within the project.
            Event::Start(Tag::Link { .. }) | Event::End(TagEnd::Link) => {}
            Event::End(TagEnd::Heading(level)) => {
                let text = html(&events[text_from..]);
                match level as usize {
                    1 => title = text,
                    n => {
                        let id = text_from - 1;
                        contents += &format!("<a class=\"h{n}\" href=\"#s{id}\">{text}</a>\n");
                    }
                }
                events.push(event);
            }
            Event::Start(Tag::Image { dest_url, .. }) => {
                let path = folder.join(&*dest_url);
                let svg = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
                // A figure within a page needs no name space.
                let svg = svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
                // A figure must not be inside a paragraph.
                events.pop_if(|before| *before == Event::Start(Tag::Paragraph));
                events.push(Event::Html(format!("<figure>{svg}<figcaption>").into()));
            }
            Event::End(TagEnd::Image) => events.push(raw(FIGURE_END)),
            Event::End(TagEnd::Paragraph) if events.last() == Some(&raw(FIGURE_END)) => {}
            Event::Start(Tag::Table(_)) => {
                events.extend([raw("<div class=\"wide\">"), event]);
            }
            Event::End(TagEnd::Table) => events.extend([event, raw("</div>\n")]),
            _ => events.push(event),
        }
    }
    template(include_str!("page.html")).fill(&[
        ("title", &title),
        ("contents", &contents),
        ("body", &html(&events)),
    ])
}

fn html(events: &[Event<'_>]) -> String {
    let mut text = String::new();
    push_html(&mut text, events.iter().cloned());
    text
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
            "<td><code>1 | 2</code></td><td><strong>3</strong> <em>4</em></td>",
            "<li>one\ntwo</li>",
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
