"""The ground library as commands and over HTTP: what it covers, and DEMs that are made from it."""
