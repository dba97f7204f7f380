"""What a run keeps on the station's disk: journal, blocks of samples, records; and what follows from them."""
