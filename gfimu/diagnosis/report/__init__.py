"""The verdict in words and pictures: sentences, figures, the HTML page, the rerun recording, the folder."""
