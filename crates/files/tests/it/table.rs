//! Tables as written by programs and spreadsheets of any locale.

use hwall_files::{Row, Table, TableError};
use std::io::{BufReader, Read};

type Rows = Vec<(u64, Vec<String>)>;

fn rows_of(mut table: Table<impl std::io::BufRead>) -> Result<(Vec<String>, Rows), TableError> {
    let mut rows = Vec::new();
    let mut row = Row::default();
    while table.next_row(&mut row)? {
        rows.push((row.line(), row.cells().map(str::to_owned).collect()));
    }
    Ok((table.header().to_vec(), rows))
}

fn read(text: impl AsRef<[u8]>) -> Result<(Vec<String>, Rows), TableError> {
    rows_of(Table::new(text.as_ref())?)
}

fn row(line: u64, cells: [&str; 2]) -> (u64, Vec<String>) {
    (line, cells.map(str::to_owned).to_vec())
}

/// The numbers of the second line.
fn numbers(text: &str) -> Vec<Result<Option<f64>, String>> {
    let mut table = Table::new(text.as_bytes()).unwrap();
    let mut row = Row::default();
    assert!(table.next_row(&mut row).unwrap());
    let number = |i| row.number(i).map_err(str::to_owned);
    (0..table.header().len()).map(number).collect()
}

#[test]
fn the_form_of_a_table_does_not_matter() {
    let plain = "who,x\nann,1\nbob,2\n";
    let wanted = read(plain).unwrap();
    assert_eq!(wanted.1, [row(2, ["ann", "1"]), row(3, ["bob", "2"])]);
    for separator in [",", ";", "\t", "|"] {
        for end in ["\n", "\r\n", "\r"] {
            let text = plain.replace(',', separator).replace('\n', end);
            let behind = text.replace(end, &format!("{separator}{separator}{end}"));
            let quoted = text.replace("ann", " \"ann\" ").replace('x', "\"x\"");
            for text in [&text, &behind, &quoted, text.trim_end()] {
                assert_eq!(read(text).as_ref(), Ok(&wanted), "{text:?}");
                assert_eq!(read(format!("\u{feff}{text}")).as_ref(), Ok(&wanted));
            }
        }
    }
}

#[test]
fn lines_are_counted_as_an_editor_does() {
    struct Pieces<'a>(&'a [u8], usize);
    impl Read for Pieces<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            let most = buffer.len().min(self.1);
            self.0.read(&mut buffer[..most])
        }
    }
    for (text, lines) in [
        ("a,b\n1,2\n3,4\n", &[2, 3][..]),
        ("a,b\r\n1,2\r\n3,4\r\n5,6", &[2, 3, 4]),
        ("\n\na,b\n\n1,2\n\n\n3,4\n\n", &[5, 8]),
        ("\r\na,b\r\n\r\n1,2\r\n\r\n\r\n3,4\r\n", &[4, 7]),
        ("a,b\r1,2\r\r3,4\r", &[2, 4]),
        ("\u{feff}a,b\n1,\"2\"\n3,4\n", &[2, 3]),
        ("a,b\n1,\"2\r\n\n3\"\n3,4\n", &[2, 5]),
    ] {
        for piece in [1, 2, 5, 1000] {
            let source = BufReader::with_capacity(piece, Pieces(text.as_bytes(), piece));
            let rows = rows_of(Table::new(source).unwrap()).unwrap().1;
            let found: Vec<u64> = rows.iter().map(|row| row.0).collect();
            assert_eq!(found, lines, "{text:?} in pieces of {piece}");
        }
    }
}

#[test]
fn text_that_is_not_utf8_is_latin1() {
    let rows = read(b"who,x\nJos\xe9,1\n\xc3\xa9,2\n").unwrap().1;
    assert_eq!(rows, [row(2, ["Jos\u{e9}", "1"]), row(3, ["\u{e9}", "2"])]);
    let utf16: Vec<u8> = "\u{feff}a,b\n1,2\n"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    assert_eq!(read(utf16), Err(TableError::NotText { line: 1 }));
}

#[test]
fn decimal_commas_are_read_where_commas_do_not_separate() {
    for separator in [";", "\t", "|"] {
        let text = ["a", "b", "c\n1,5", "-2.5e3", "1,5e-3\n"].join(separator);
        assert_eq!(numbers(&text), [1.5, -2500.0, 0.0015].map(|x| Ok(Some(x))));
        // Also without a header line.
        let text = ["0,25", "1,5\n"].join(separator);
        let mut table = Table::with_names(text.as_bytes(), &["t", "x"]).unwrap();
        let mut row = Row::default();
        assert!(table.next_row(&mut row).unwrap());
        let read = [0, 1].map(|i| row.number(i));
        assert_eq!(read, [0.25, 1.5].map(|x| Ok(Some(x))));
    }
    assert_eq!(numbers("a,b\n\"1,5\",2\n")[0], Err("1,5".to_owned()));
    let wrong = ["1.000,5", "1,2,3"].map(|text| Err(text.to_owned()));
    assert_eq!(numbers("a;b\n1.000,5;1,2,3\n"), wrong);
}

#[test]
fn missing_values_have_many_names() {
    let missing = numbers("a,b,c,d,e,f\n,NaN,nan,NA,N/A,-nan\n");
    assert_eq!(missing, vec![Ok(None); 6]);
    for text in ["inf", "-Infinity", "1e999", "x", "1 2", "--1"] {
        let read = numbers(&format!("a,b\n{text},2\n"));
        assert_eq!(read[0], Err(text.to_owned()));
    }
}

#[test]
fn what_is_no_table_is_refused_by_line() {
    let line = |text: &str| read(text).unwrap_err().to_string();
    for empty in ["", "\n \n", "\u{feff}", ",,,\n"] {
        assert_eq!(read(empty), Err(TableError::Empty), "{empty:?}");
    }
    assert_eq!(line("a,b\n\n1\n"), "line 3: 1 cell, the header has 2");
    assert_eq!(line("a,b\n1,2,,3\n"), "line 2: 4 cells, the header has 2");
    let open = "a,b\n1,2\n\"1,2\n3,4\n";
    assert_eq!(line(open), "line 3: a quoted cell does not end");
    let wide = format!("a{}\n", ",a".repeat(1_000_000));
    let too_many = TableError::TooManyCells {
        line: 1,
        got: 1_000_001,
        most: 10_000,
    };
    assert_eq!(read(wide), Err(too_many));
}

/// Bits flipped, pieces cut and joined: no panic, and every row has as many cells as the header.
#[test]
fn damaged_tables_do_no_harm() {
    let seeds: [&[u8]; 3] = [
        b"t;x\r\n0,5;\"1\"\"2\"\r\n\r\n1;NaN;;\r\n",
        b"\xef\xbb\xbft,x\n0,\"a\nb\"\n\xe9,2",
        b"0,5\t1\r0,75\t2\r",
    ];
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for _ in 0..20_000 {
        let mut bytes = seeds[random(3)].to_vec();
        for _ in 0..1 + random(4) {
            let at = random(bytes.len());
            match random(3) {
                0 => bytes[at] ^= 1 << random(8),
                1 => bytes.insert(at, b",;\t|\"\r\n 0\0"[random(10)]),
                _ => bytes.extend_from_within(at..),
            }
        }
        if let Ok((header, rows)) = read(&bytes) {
            assert!(rows.iter().all(|row| row.1.len() == header.len()));
        }
        if let Ok(table) = Table::with_names(&bytes[..], &["t", "x"]) {
            let _ = rows_of(table);
        }
    }
}
