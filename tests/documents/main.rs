//! Tests of the documents: their links, their formulas, and the equations that the code cites.

mod citations;
mod formulas;
mod links;
mod site;
