//! Rendering of encountered-type haptics: the arm interface, the contact state machine, speed limits and watchdogs.
