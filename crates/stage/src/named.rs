//! Enums whose variants have names in tables.

/// An enum with a name for each variant, `ALL` of them in this order, and `name()`.
#[macro_export]
macro_rules! named {
    ($(#[$meta:meta])* $vis:vis enum $name:ident {
        $($(#[$doc:meta])* $variant:ident = $text:literal,)+
    }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis enum $name {
            $($(#[$doc])* $variant,)+
        }

        #[allow(dead_code)]
        impl $name {
            /// All, in the order of the tables.
            $vis const ALL: [Self; [$($text),+].len()] = [$(Self::$variant),+];

            /// For tables.
            #[must_use]
            $vis const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)+
                }
            }
        }
    };
}
