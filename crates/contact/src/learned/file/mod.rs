//! Files of learned models.

mod input_file;
mod model_file;
mod tree_file;
