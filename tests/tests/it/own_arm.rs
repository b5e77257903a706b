//! The program that a stranger starts from, as it stands in the documentation.

#[allow(unreachable_pub)] // the main function of a program
#[path = "../../../crates/hwall/examples/own_arm.rs"]
mod program;

#[test]
fn the_first_program_brings_the_board_in_place() {
    program::main().expect("the board ends in place");
}
