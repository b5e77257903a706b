//! Scenes for encountered-type haptics: OBJ rooms with named touchable surfaces, moving doors, watertight ray casts and closest points.
