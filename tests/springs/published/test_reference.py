from springs.published.reference import Reference, Sample, SampleKind, Sureness


def test_a_reference_reads_as_one_line():
    reference = Reference("A. Author, Title, 1999", Sureness.SEVERAL_CODES, "10.1/x", "table 2")
    assert str(reference) == (
        "A. Author, Title, 1999; table 2; doi:10.1/x "
        "[C2: the same in two or more independent code bases]"
    )


def test_what_is_not_known_is_left_out():
    assert str(Reference("A page", Sureness.PAGE)) == "A page [P: read on a page]"


def test_every_degree_of_sureness_has_words():
    assert len({kind.description for kind in Sureness}) == len(Sureness)


def test_a_sample_reads_as_words():
    assert str(Sample(SampleKind.LIVING, 20)) == "20 living subjects"
    assert str(Sample(SampleKind.LIVING, 1)) == "1 living subject"
    assert str(Sample(SampleKind.CADAVERS)) == "cadavers"
    assert [kind for kind in SampleKind if Sample(kind).is_measured] == [
        SampleKind.LIVING,
        SampleKind.CADAVERS,
    ]
    assert len({str(Sample(kind)) for kind in SampleKind}) == len(SampleKind)
