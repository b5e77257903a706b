//! A simulated KUKA iiwa and a simulated person for encountered-type haptics: servo-level arm, reaches, seeded.
