//! One run of the closed loop: what it leaves behind, and how it is judged.

pub mod closed_loop;
pub mod judge;
pub mod texture_log;
pub mod tick;
pub mod trace;
