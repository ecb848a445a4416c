//! Rows as Parquet: columns of whole numbers (INT64), of numbers (DOUBLE) and of texts, in row groups of some
//! megabytes, uncompressed. A text that is empty is no value, as readers of CSV have it.

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};
use std::io::{self, Write};
use std::sync::Arc;

/// Cells of a row group: what memory holds of a table, in 8 or 16 bytes each.
const CELLS: usize = 1 << 20;

/// Which columns are no numbers with digits after the point.
const WHOLE: [&str; 9] =
    ["k", "body", "contact", "partner_index", "contacts", "iterations", "joint", "gear", "alpha"];
const TEXTS: [&str; 4] = ["status", "start", "partner", "key"];

/// The cells of a column that wait for their row group.
enum Column {
    Whole(Vec<i64>),
    Numbers(Vec<f64>),
    /// Those that are not empty, and of every cell 1 where it is not.
    Texts(Vec<ByteArray>, Vec<i16>),
}

impl Column {
    /// Of this name; numbered ones are of the kind of their name.
    fn of(name: &str) -> Self {
        let name = name.trim_end_matches(|c: char| c.is_ascii_digit());
        match name {
            _ if WHOLE.contains(&name) => Self::Whole(Vec::new()),
            _ if TEXTS.contains(&name) => Self::Texts(Vec::new(), Vec::new()),
            _ => Self::Numbers(Vec::new()),
        }
    }

    fn field(&self, name: &str) -> Result<Type, ParquetError> {
        let (kind, meaning, repetition) = match self {
            Self::Whole(_) => (Physical::INT64, None, Repetition::REQUIRED),
            Self::Numbers(_) => (Physical::DOUBLE, None, Repetition::REQUIRED),
            Self::Texts(..) => {
                (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::OPTIONAL)
            }
        };
        let field = Type::primitive_type_builder(name, kind).with_logical_type(meaning);
        field.with_repetition(repetition).build()
    }
}

/// A table that is being written.
pub struct ParquetRows<W: Write + Send> {
    file: SerializedFileWriter<W>,
    columns: Vec<Column>,
    /// The column of the next cell.
    at: usize,
    rows: usize,
}

impl<W: Write + Send> ParquetRows<W> {
    pub fn new<'a>(stream: W, names: impl IntoIterator<Item = &'a str>) -> io::Result<Self> {
        let names: Vec<_> = names.into_iter().collect();
        let columns: Vec<_> = names.iter().map(|name| Column::of(name)).collect();
        let mut properties = WriterProperties::builder()
            .set_created_by(concat!("tumble ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None);
        // Texts are few different ones, but for keys.
        for text in TEXTS {
            properties = properties.set_column_dictionary_enabled(ColumnPath::from(text), true);
        }
        let fields = columns.iter().zip(&names).map(|(column, name)| column.field(name));
        let fields = fields.map(|field| field.map(Arc::new)).collect::<Result<_, _>>();
        let file = fields.and_then(|fields| {
            let schema = Type::group_type_builder("table").with_fields(fields).build()?;
            SerializedFileWriter::new(stream, Arc::new(schema), Arc::new(properties.build()))
        });
        Ok(Self { file: file.map_err(of_stream)?, columns, at: 0, rows: 0 })
    }

    /// The column of the next cell, if the row has one more.
    fn next(&mut self) -> Option<&mut Column> {
        self.at += 1;
        self.columns.get_mut(self.at - 1)
    }

    pub fn whole(&mut self, value: u64) {
        if let Some(Column::Whole(values)) = self.next() {
            values.push(value.cast_signed());
        }
    }

    pub fn number(&mut self, value: f64) {
        if let Some(Column::Numbers(values)) = self.next() {
            values.push(value);
        }
    }

    pub fn text(&mut self, value: &[u8]) {
        if let Some(Column::Texts(values, levels)) = self.next() {
            levels.push(i16::from(!value.is_empty()));
            if !value.is_empty() {
                values.push(ByteArray::from(value.to_vec()));
            }
        }
    }

    pub fn end_row(&mut self) -> io::Result<()> {
        self.at = 0;
        self.rows += 1;
        if self.rows * self.columns.len() < CELLS { Ok(()) } else { self.write_group() }
    }

    fn write_group(&mut self) -> io::Result<()> {
        self.rows = 0;
        let mut write = || -> Result<(), ParquetError> {
            let mut group = self.file.next_row_group()?;
            for column in &mut self.columns {
                let Some(mut writer) = group.next_column()? else { break };
                match (writer.untyped(), column) {
                    (ColumnWriter::Int64ColumnWriter(writer), Column::Whole(values)) => {
                        writer.write_batch(values, None, None)?;
                        values.clear();
                    }
                    (ColumnWriter::DoubleColumnWriter(writer), Column::Numbers(values)) => {
                        writer.write_batch(values, None, None)?;
                        values.clear();
                    }
                    (
                        ColumnWriter::ByteArrayColumnWriter(writer),
                        Column::Texts(values, levels),
                    ) => {
                        writer.write_batch(values, Some(levels), None)?;
                        values.clear();
                        levels.clear();
                    }
                    _ => return Err(ParquetError::General("a column of another kind".to_owned())),
                }
                writer.close()?;
            }
            group.close().map(drop)
        };
        write().map_err(of_stream)
    }

    pub fn finish(mut self) -> io::Result<W> {
        if self.rows > 0 {
            self.write_group()?;
        }
        let mut stream = self.file.into_inner().map_err(of_stream)?;
        stream.flush()?;
        Ok(stream)
    }
}

/// The stream's own error, where it is one.
fn of_stream(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(error) => match error.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(error) => io::Error::other(error),
        },
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    /// More rows than a row group has are read back by the crate's own reader, to the last bit.
    #[test]
    fn rows_are_read_back() {
        let names = ["k", "x_m", "status", "alpha0"];
        let mut rows = ParquetRows::new(tempfile::tempfile().unwrap(), names).unwrap();
        let count = CELLS / names.len() + 10;
        let value = |k: usize| f64::from_bits(0x3ff0_0000_0000_0000 + 7919 * k as u64);
        for k in 0..count {
            rows.whole(k as u64);
            rows.number(value(k));
            rows.text(if k % 3 == 0 { b"" } else { "schön, \"ja\"".as_bytes() });
            rows.whole(1);
            rows.end_row().unwrap();
        }
        let file = SerializedFileReader::new(rows.finish().unwrap()).unwrap();
        assert_eq!(file.metadata().num_row_groups(), 2);
        let mut found = 0;
        for (k, row) in file.get_row_iter(None).unwrap().enumerate() {
            let row = row.unwrap();
            assert_eq!(row.get_long(0).unwrap(), k as i64);
            assert_eq!(row.get_double(1).unwrap().to_bits(), value(k).to_bits());
            assert_eq!(row.get_string(2).is_ok(), k % 3 != 0);
            row.get_string(2).into_iter().for_each(|text| assert_eq!(text, "schön, \"ja\""));
            assert_eq!(row.get_long(3).unwrap(), 1);
            found += 1;
        }
        assert_eq!(found, count);
    }

    /// A table without rows is a table.
    #[test]
    fn no_rows_are_a_table() {
        let rows = ParquetRows::new(tempfile::tempfile().unwrap(), ["k", "key"]).unwrap();
        let file = SerializedFileReader::new(rows.finish().unwrap()).unwrap();
        assert_eq!(file.metadata().file_metadata().num_rows(), 0);
        assert_eq!(file.metadata().file_metadata().schema().get_fields().len(), 2);
    }
}
