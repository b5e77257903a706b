//! Shared reporting of studies: tables of columns (title and cell), claims with bounds, Markdown pages
//! with gaps.

mod page;
mod table;

pub use page::{Gap, fill, page};
pub use table::{
    Claim, Column, cells, claims, grid, or_none, percent_of, quantiles, table_of, titled, yes_or_no,
};
