"""What a study holds, for other people's tools: tables, stores, trees and metadata."""
