//! Reading long tables: irrelevant variations, and errors that name line and column. Separators, line ends and encodings are for
//! the tests of `hwall-files`.

use hwall_files::TableError;
use hwall_psychophysics::{Columns, PsychophysicsError, Study};

fn columns() -> Columns {
    Columns::new("who", ["a", "b"], "y").with_round("round")
}

/// Two subjects, two by two cells, two rounds; the value encodes its cell.
fn rows() -> Vec<String> {
    let mut rows = vec!["who,a,b,round,y".to_owned()];
    for who in ["eve", "bob"] {
        for a in [1, 10] {
            for b in ["x", "w"] {
                for round in [1, 2] {
                    let y = a * 10 + if b == "x" { 1 } else { 2 } + round;
                    rows.push(format!("{who},{a},{b},{round},{y}"));
                }
            }
        }
    }
    rows
}

fn read(rows: &[String]) -> Result<Study, PsychophysicsError> {
    Study::from_csv_str(&rows.join("\n"), &columns())
}

/// What is said of a table that is refused.
fn said(result: Result<Study, PsychophysicsError>) -> String {
    result.expect_err("refused").to_string()
}

fn with(line: usize, row: &str) -> PsychophysicsError {
    let mut rows = rows();
    rows[line - 1] = row.to_owned();
    read(&rows).expect_err("refused")
}

#[test]
fn values_are_averaged_into_their_cells() {
    let study = read(&rows()).expect("a study");
    assert_eq!(study.subjects(), ["eve", "bob"]);
    assert_eq!(study.within()[0].levels, ["1", "10"]);
    assert_eq!(study.within()[1].levels, ["x", "w"]);
    assert_eq!(study.rounds(), 2);
    assert_eq!(study.values()[..4], [12.5, 13.5, 102.5, 103.5]);
    assert_eq!(study.cell_name(2), "a=10, b=x");
}

#[test]
fn capitals_order_and_spelling_of_numbers_do_not_matter() {
    let plain = read(&rows()).expect("a study");
    let mut shouted = rows();
    shouted[0] = "\"WHO\", A ,B,Round,Y".to_owned();
    assert_eq!(read(&shouted).as_ref(), Ok(&plain));
    // Rows in any order: only the order of subjects depends on it.
    let mut turned = rows();
    turned[1..].rotate_left(4);
    let turned = read(&turned).expect("a study");
    assert_eq!(turned.values(), plain.values());
    // Numbers are levels by value, and in order of size.
    let text = "s,a,y\n1,10,1\n1,9.0,2\n2,9,3\n2,1e1,5\n";
    let study = Study::from_csv_str(text, &Columns::new("s", ["a"], "y")).expect("a study");
    assert_eq!(study.within()[0].levels, ["9.0", "10"]);
    assert_eq!(study.values(), [2.0, 1.0, 3.0, 5.0]);
}

#[test]
fn cells_are_refused_by_line_and_column() {
    for text in ["NaN", "", "NA", "1.2.3", "inf"] {
        let error = with(4, &format!("eve,1,w,1,{text}"));
        let column = "y".to_owned();
        let text = text.to_owned();
        let line = 4;
        assert_eq!(error, PsychophysicsError::NotANumber { line, column, text });
    }
    for (row, error) in [
        ("eve,,w,2,3", "line 5, column \"a\" is empty"),
        ("eve,1,w,2", "line 5: 4 cells, the header has 5"),
        (
            "eve,1,w,2,\"1,5\"",
            "line 5, column \"y\": \"1,5\" is not a finite number",
        ),
    ] {
        assert_eq!(with(5, row).to_string(), error);
    }
    // Blank lines count.
    let blank = read(&["who,a,b,round,y\n\neve,1,x,1,?".to_owned()]);
    assert!(said(blank).starts_with("line 3, "));
}

#[test]
fn doubles_and_gaps_are_named() {
    assert_eq!(
        with(5, "eve,1,w,1,3").to_string(),
        "line 5: subject \"eve\" already has a value for a=1, b=w, round=1 on line 4"
    );
    let mut fewer = rows();
    fewer.truncate(15);
    assert_eq!(
        said(read(&fewer)),
        "subject \"bob\" has no value for a=10, b=w, round=1, and 1 more value is missing"
    );
    let no_round = Columns::new("who", ["a", "b"], "y");
    assert_eq!(
        said(Study::from_csv_str(&rows().join("\n"), &no_round)),
        "line 3: subject \"eve\" already has a value for a=1, b=x on line 2; repeated trials need a round column"
    );
}

/// A column of times used as a factor: its gaps are reported without allocating all cells.
#[test]
fn continuous_columns_are_no_factors() {
    let mut text = "s,t,u,v,y\n".to_owned();
    for i in 0..20_000 {
        text += &format!("{},{i}.5,{},{i},1\n", i % 25, 40_000 - i);
    }
    let columns = Columns::new("s", ["t", "u", "v"], "y");
    assert!(matches!(
        Study::from_csv_str(&text, &columns),
        Err(PsychophysicsError::MissingCell { missing, .. }) if missing == 200_000_000_000_000 - 20_000
    ));
}

#[test]
fn headers_are_refused() {
    let header = |text: &str| {
        let mut rows = rows();
        rows[0] = text.to_owned();
        said(read(&rows))
    };
    for (text, error) in [
        (
            "who,a,c,round,y",
            "no column \"b\" in the header \"who,a,c,round,y\"",
        ),
        (
            "who,A,B,b,y",
            "no column \"round\" in the header \"who,A,B,b,y\"",
        ),
        ("who,a,b,b,y", "column \"b\" occurs 2 times in the header"),
        ("", "no column \"who\" in the header \"eve,1,x,1,12\""),
    ] {
        assert_eq!(header(text), error);
    }
    let empty = PsychophysicsError::Table(TableError::Empty);
    assert_eq!(read(&[]), Err(empty));
    assert_eq!(read(&rows()[..1]), Err(PsychophysicsError::NoRows));
    let twice = Columns::new("who", ["a", "A"], "y");
    let twice = Study::from_csv_str(&rows().join("\n"), &twice);
    assert!(matches!(twice, Err(PsychophysicsError::ColumnTwice { .. })));
    let missing = Study::from_csv_path("no such file", &columns());
    let Err(PsychophysicsError::File { kind, .. }) = missing else {
        panic!("{missing:?}");
    };
    assert_eq!(kind, std::io::ErrorKind::NotFound);
}

#[test]
fn groups_and_levels_are_checked() {
    let columns = Columns::new("s", ["a"], "y").with_between("g");
    let read = |text: &str| Study::from_csv_str(text, &columns);
    let text = "s,g,a,y\n1,u,1,3\n1,v,2,4\n2,v,1,5\n2,v,2,5\n";
    assert_eq!(
        said(read(text)),
        "line 3: subject \"1\" is in \"v\" and on line 2 in another \"g\""
    );
    assert_eq!(
        said(read("s,g,a,y\n1,u,1,3\n1,u,2,4\n")),
        "factor \"g\" has only the level \"u\", it needs two or more"
    );
    assert!(matches!(
        read("s,g,a,y\n1,u,1,3\n2,v,1,4\n"),
        Err(PsychophysicsError::OneLevel { .. })
    ));
    let no_factor = Columns::new("s", [""; 0], "y");
    assert_eq!(
        said(Study::from_csv_str("s,y\n1,2\n", &no_factor)),
        "0 factors within subjects, it must be 1 to 4"
    );
}
