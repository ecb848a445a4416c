//! Reader of the text format.

use crate::problem::{ContactProblem, Law, ProblemError, SparseMatrix};

/// Parse error. Each message names the line and the expected word.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DatError {
    /// A word is not the expected one.
    #[error("line {line}: found {found:?}; expected {wanted}")]
    Word {
        /// Line, counted from 1.
        line: usize,
        /// Word in the text.
        found: String,
        /// Expected word.
        wanted: &'static str,
    },
    /// The text ends too early.
    #[error("it ends too early; expected {0}")]
    End(&'static str),
    /// The number of entries of a sparse matrix differs from its header.
    #[error("line {line}: the header has {declared} entries, but {found} follow")]
    Entries {
        /// Line of the header, counted from 1.
        line: usize,
        /// Number of entries in the header.
        declared: String,
        /// Number of entries in the text.
        found: usize,
    },
    /// The text continues after the last number.
    #[error(
        "line {line}: found {found:?} after the last coefficient of friction; expected the end"
    )]
    Rest {
        /// Line, counted from 1.
        line: usize,
        /// Word in the text.
        found: String,
    },
    /// The matrices form an invalid problem.
    #[error(transparent)]
    Problem(#[from] ProblemError),
}

/// Parses a problem.
///
/// # Errors
/// A text that does not follow the format, with the line; a problem that is
/// [invalid](ProblemError).
pub fn read(text: &str) -> Result<ContactProblem, DatError> {
    let mut words = Words::new(text);
    let dimension = words.count("the dimension of a contact")?;
    let contacts = words.count("the number of contacts")?;
    let rows = dimension.saturating_mul(contacts);
    let first = words.matrix("M")?;
    // A local problem continues with q, μ and perhaps a mark. A global one continues with another
    // matrix. Numbers can look like the head of a matrix; then their count decides.
    let left = words.left();
    let of_local = first.rows().saturating_add(contacts);
    let is_local = first.rows() == rows
        && (left == of_local || left == of_local + 1 || !words.begins_matrix(rows, rows));
    let problem = if is_local {
        let free = words.numbers(rows, "a number of q")?;
        let laws = words.laws(dimension, contacts)?;
        ContactProblem::local(first, free, laws)?
    } else {
        let directions = words.matrix("H")?;
        let momentum = words.numbers(first.rows(), "a number of f")?;
        let offset = words.numbers(directions.columns(), "a number of w")?;
        let laws = words.laws(dimension, contacts)?;
        ContactProblem::global(first, directions, momentum, offset, laws)?
    };
    words.end()?;
    Ok(problem)
}

/// Words of a text with their lines.
struct Words<'a> {
    words: Vec<(usize, &'a str)>,
    at: usize,
}

impl<'a> Words<'a> {
    fn new(text: &'a str) -> Self {
        let lines = text.lines().enumerate();
        let words = lines
            .flat_map(|(line, text)| text.split_whitespace().map(move |word| (line + 1, word)));
        Self { words: words.collect(), at: 0 }
    }

    /// Number of words left.
    fn left(&self) -> usize {
        self.words.len() - self.at
    }

    fn next(&mut self, wanted: &'static str) -> Result<(usize, &'a str), DatError> {
        let word = *self.words.get(self.at).ok_or(DatError::End(wanted))?;
        self.at += 1;
        Ok(word)
    }

    fn parsed<T: std::str::FromStr>(&mut self, wanted: &'static str) -> Result<T, DatError> {
        let (line, word) = self.next(wanted)?;
        let refusal = || DatError::Word { line, found: shortened(word), wanted };
        word.parse().map_err(|_| refusal())
    }

    /// Parses a count. It is at most the number of words, since each counted item has a word.
    fn count(&mut self, wanted: &'static str) -> Result<usize, DatError> {
        let count = self.parsed(wanted)?;
        if count > self.words.len() {
            let (line, word) = self.words[self.at - 1];
            return Err(DatError::Word { line, found: shortened(word), wanted });
        }
        Ok(count)
    }

    fn number(&mut self, wanted: &'static str) -> Result<f64, DatError> {
        let number: f64 = self.parsed(wanted)?;
        if number.is_finite() {
            return Ok(number);
        }
        let (line, word) = self.words[self.at - 1];
        Err(DatError::Word { line, found: shortened(word), wanted })
    }

    fn numbers(&mut self, count: usize, wanted: &'static str) -> Result<Vec<f64>, DatError> {
        (0..count).map(|_| self.number(wanted)).collect()
    }

    fn counts(&mut self, count: usize, wanted: &'static str) -> Result<Vec<usize>, DatError> {
        (0..count).map(|_| self.count(wanted)).collect()
    }

    /// True if a matrix of this size follows: its storage, its rows, its columns.
    fn begins_matrix(&self, rows: usize, columns: usize) -> bool {
        let is = |at: usize, known: &dyn Fn(&str) -> bool| {
            self.words.get(self.at + at).is_some_and(|(_, word)| known(word))
        };
        let counts = |count: usize| move |word: &str| word.parse() == Ok(count);
        is(0, &|word| matches!(word, "0" | "1" | "2"))
            && is(1, &counts(rows))
            && is(2, &counts(columns))
    }

    /// Skips the next word if it equals `word`.
    fn passes(&mut self, word: &str) -> bool {
        let is_there = self.words.get(self.at).is_some_and(|(_, found)| *found == word);
        self.at += usize::from(is_there);
        is_there
    }

    fn expect(&mut self, word: &'static str) -> Result<(), DatError> {
        if self.passes(word) {
            return Ok(());
        }
        let (line, found) = self.next(word)?;
        Err(DatError::Word { line, found: shortened(found), wanted: word })
    }

    fn laws(&mut self, dimension: usize, contacts: usize) -> Result<Vec<Law>, DatError> {
        let friction = self.numbers(contacts, "a coefficient of friction")?;
        Ok(Law::contacts(dimension, &friction)?)
    }

    fn matrix(&mut self, name: &'static str) -> Result<SparseMatrix, DatError> {
        let storage = self.next("the storage of a matrix")?;
        let rows = self.count("the number of rows of a matrix")?;
        let columns = self.count("the number of columns of a matrix")?;
        let entries = match storage.1 {
            "0" => self.dense(rows, columns)?,
            "1" => self.blocks()?,
            "2" => self.sparse(rows, columns)?,
            _ => {
                let (line, found) = (storage.0, shortened(storage.1));
                let wanted = match name {
                    "M" => "the storage of M (0 dense, 1 blocks, 2 sparse)",
                    _ => "the storage of H (0 dense, 1 blocks, 2 sparse)",
                };
                return Err(DatError::Word { line, found, wanted });
            }
        };
        Ok(SparseMatrix::from_triplets(rows, columns, entries)?)
    }

    /// Parses all entries in column-major order.
    fn dense(&mut self, rows: usize, columns: usize) -> Result<MatrixEntries, DatError> {
        for (wanted, count) in
            [("the same number of rows", rows), ("the same number of columns", columns)]
        {
            let at = self.at;
            if self.count(wanted)? != count {
                let (line, word) = self.words[at];
                return Err(DatError::Word { line, found: shortened(word), wanted });
            }
        }
        let mut entries = Vec::new();
        for column in 0..columns {
            for row in 0..rows {
                entries.push((row, column, self.number("an entry of a dense matrix")?));
            }
        }
        Ok(entries)
    }

    /// Parses blocks, row by row. Each has its number before its entries in column-major order.
    fn blocks(&mut self) -> Result<MatrixEntries, DatError> {
        if self.count("the number of blocks")? == 0 {
            return Ok(Vec::new());
        }
        let rows = self.count("the number of rows of blocks")?;
        let columns = self.count("the number of columns of blocks")?;
        let row_ends = self.ends(rows, "the end of a row of blocks")?;
        let column_ends = self.ends(columns, "the end of a column of blocks")?;
        let (starts, places) = (
            self.count("the number of starts of rows of blocks")?,
            self.count("the number of column indices of blocks")?,
        );
        let starts = self.counts(starts, "the start of a row of blocks")?;
        let places = self.counts(places, "the column of a block")?;
        let mut entries = Vec::new();
        for (row, range) in starts.windows(2).enumerate() {
            let (begin, end) = (range[0], range[1].min(places.len()));
            for &column in places.get(begin..end).unwrap_or(&[]) {
                self.count("the number of a block")?;
                let (Some(&(top, bottom)), Some(&(left, right))) =
                    (row_ends.get(row), column_ends.get(column))
                else {
                    let (line, word) = self.words[self.at - 1];
                    let wanted = "a block inside its matrix";
                    return Err(DatError::Word { line, found: shortened(word), wanted });
                };
                for j in left..right {
                    for i in top..bottom {
                        entries.push((i, j, self.number("an entry of a block")?));
                    }
                }
            }
        }
        Ok(entries)
    }

    /// Parses index ranges from their ends.
    fn ends(
        &mut self,
        count: usize,
        wanted: &'static str,
    ) -> Result<Vec<(usize, usize)>, DatError> {
        let mut begin = 0;
        let mut ranges = Vec::new();
        for end in self.counts(count, wanted)? {
            ranges.push((begin, end));
            begin = end;
        }
        Ok(ranges)
    }

    /// Parses CSparse's print: a version line, a line of sizes, and triplets or columns.
    fn sparse(&mut self, rows: usize, columns: usize) -> Result<MatrixEntries, DatError> {
        if !self.passes("CSparse") {
            // A first number says which form is the original one. The print shows the form too.
            self.number("the origin of a sparse matrix")?;
            self.expect("CSparse")?;
        }
        let line = self.words[self.at - 1].0;
        while self.words.get(self.at).is_some_and(|(other, _)| *other == line) {
            self.at += 1;
        }
        let is_triplets = self.passes("triplet:");
        let wanted = "the size of the sparse matrix, equal to its rows and columns";
        let (line, size) = self.next(wanted)?;
        let sizes = size.trim_end_matches(',').split_once("-by-");
        if !sizes.is_some_and(|(a, b)| is_printed(a, rows) && is_printed(b, columns)) {
            return Err(DatError::Word { line, found: shortened(size), wanted });
        }
        self.expect("nzmax:")?;
        self.next("the capacity of a sparse matrix")?;
        self.expect("nnz:")?;
        let (line, declared) = self.next("the number of entries of a sparse matrix")?;
        let declared = declared.trim_end_matches(',');
        let entries =
            if is_triplets { self.triplets()? } else { self.columns_of_entries(columns)? };
        if !is_printed(declared, entries.len()) {
            let (declared, found) = (shortened(declared), entries.len());
            return Err(DatError::Entries { line, declared, found });
        }
        Ok(entries)
    }

    /// Parses row, column and value of all following entries.
    fn triplets(&mut self) -> Result<MatrixEntries, DatError> {
        let mut entries = Vec::new();
        while self.words.get(self.at + 2).is_some_and(|(_, word)| *word == ":") {
            let row = self.count("the row of an entry")?;
            let column = self.count("the column of an entry")?;
            self.expect(":")?;
            entries.push((row, column, self.number("an entry of a sparse matrix")?));
        }
        Ok(entries)
    }

    /// Parses every column: its range of entries and the entries.
    fn columns_of_entries(&mut self, columns: usize) -> Result<MatrixEntries, DatError> {
        if self.passes("1-norm:") {
            self.number("the norm of a sparse matrix")?;
        }
        let mut entries = Vec::new();
        for column in 0..columns {
            self.expect("col")?;
            let wanted = "the next column of a sparse matrix";
            let (line, word) = self.next(wanted)?;
            if word.parse() != Ok(column) {
                return Err(DatError::Word { line, found: shortened(word), wanted });
            }
            self.expect(":")?;
            self.expect("locations")?;
            let first: i64 = self.parsed("the first index of a column")?;
            self.expect("to")?;
            let last: i64 = self.parsed("the last index of a column")?;
            let before = entries.len();
            while self.words.get(self.at + 1).is_some_and(|(_, word)| *word == ":") {
                let row = self.count("the row of an entry")?;
                self.expect(":")?;
                entries.push((row, column, self.number("an entry of a sparse matrix")?));
            }
            let found = entries.len() - before;
            let declared = i128::from(last) - i128::from(first) + 1;
            if declared != found as i128 {
                return Err(DatError::Entries { line, declared: declared.to_string(), found });
            }
        }
        Ok(entries)
    }

    /// Checks the end of the text. One mark may follow, which says that a solution is stored
    /// elsewhere.
    fn end(&mut self) -> Result<(), DatError> {
        let mark = self.left() == 1 && (self.passes("0") || self.passes("1"));
        if mark || self.left() == 0 {
            return Ok(());
        }
        let (line, found) = self.words[self.at];
        Err(DatError::Rest { line, found: shortened(found) })
    }
}

type MatrixEntries = Vec<(usize, usize, f64)>;

/// True if a word is the count as C prints it, with six digits.
fn is_printed(word: &str, count: usize) -> bool {
    let rounded = |printed: f64| {
        let apart = (printed - count as f64).abs();
        apart == 0.0 || (printed >= 1e6 && apart <= 5e-6 * printed)
    };
    word.parse().is_ok_and(rounded)
}

/// Shortens a word for an error message.
fn shortened(word: &str) -> String {
    const MOST: usize = 40;
    if word.chars().count() <= MOST {
        return word.to_owned();
    }
    word.chars().take(MOST).chain("…".chars()).collect()
}
