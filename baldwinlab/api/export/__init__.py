"""Export studies to third-party tools: tables, stores, data trees and metadata."""
