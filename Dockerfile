# One image for all services of docker-compose.yml, which says what each runs.
FROM python:3.11-slim

WORKDIR /app
RUN useradd --create-home gaplab

COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY api api
COPY migrations migrations
COPY schemas schemas
COPY services services
COPY src src
COPY workers workers
RUN pip install --no-cache-dir --constraint constraints.txt .

USER gaplab
EXPOSE 8000
CMD ["python", "-m", "api"]
