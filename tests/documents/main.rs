//! Tests of the documents: their links, their formulas, the equations that the code cites, the order
//! of imports, and idioms of the code.

mod citations;
mod formulas;
mod idioms;
mod imports;
mod links;
mod site;
