//! Error statistics, tolerances, seeded samplers, timing and report tables for the H-Wall tests and reports.
