"""Nothing is lost and nobody is stuck: safe files, locks of folders, signals, supervision. Imports `errors` alone."""
