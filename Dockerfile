# The steps of a bare Debian 12: Python, make and certificates from Debian, everything else by the project's own set-up.
#   docker build -t manitwin . && docker run --rm -v "$PWD:/data" manitwin build /data/photo.jpg -o /data/twins
FROM debian:12-slim
RUN apt-get update \
 && apt-get install -y --no-install-recommends python3 python3-venv make ca-certificates \
 && rm -rf /var/lib/apt/lists/*
WORKDIR /opt/manitwin
COPY . .
RUN make setup \
 && rm -rf /var/lib/apt/lists/* /root/.cache
WORKDIR /data
ENV PATH="/opt/manitwin/.venv/bin:$PATH"
ENTRYPOINT ["manitwin"]
