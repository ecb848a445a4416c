//! Tests of the documents: their links, their formulas, the equations that the code cites, and the
//! order of imports.

mod citations;
mod formulas;
mod imports;
mod links;
mod site;
