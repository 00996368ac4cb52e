"""The report of a finished study: page, figures, interactive views, films and files for ParaView."""
