//! Tests of the documents: their links, their formulas, their statements of the tree, the equations
//! that the code cites, the order and the circles of imports, and idioms of the code.

mod citations;
mod formulas;
mod idioms;
mod imports;
mod links;
mod site;
mod statements;
